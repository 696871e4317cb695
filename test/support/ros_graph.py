"""A ROS graph of the test session's own, on this machine only; its import sets it up."""

import os
import random
from collections.abc import Iterator

import pytest

from pop_ros.dds_profile import use_large_shared_memory

# Before anything initialises rclpy; child processes inherit it. Domains up to 101 keep clear of
# the ports that Linux hands out.
os.environ['ROS_DOMAIN_ID'] = str(random.SystemRandom().randint(1, 101))
os.environ['ROS_AUTOMATIC_DISCOVERY_RANGE'] = 'LOCALHOST'
# An image lost on the way is sent again only seconds later; that is not what these tests test.
use_large_shared_memory()


@pytest.fixture(scope='session', autouse=True)
def log_folder(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Keep the logs of nodes out of the home folder."""
    os.environ['ROS_LOG_DIR'] = str(tmp_path_factory.mktemp('ros_log'))
    yield
    os.environ.pop('ROS_LOG_DIR', None)  # every folder of tests has this fixture
