"""`pop doctor` finds what is wrong and names the camera it sees."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
import rclpy
from sensor_msgs.msg import Image
from support.node import ROOT

from pop_ros.camera_presets import CAMERA_PRESETS, CameraPresetError, camera_preset


def run_doctor(**changes: str) -> subprocess.CompletedProcess[str]:
    path = os.pathsep.join([str(ROOT), os.environ.get('PYTHONPATH', '')])
    return subprocess.run(
        [sys.executable, '-c', 'from pop_ros.doctor_command import doctor; doctor()'],
        env={**os.environ, 'PYTHONPATH': path, **changes}, capture_output=True, text=True,
        timeout=60, check=False)


def test_the_middleware_works_and_a_known_camera_is_recognised() -> None:
    rclpy.init()
    driver = rclpy.create_node('driver')
    topics = CAMERA_PRESETS['orbbec'].topics
    for topic in (topics.color, topics.depth):
        driver.create_publisher(Image, topic, 5)
    try:
        done = run_doctor()
    finally:
        driver.destroy_node()
        rclpy.shutdown()
    assert done.returncode == 0, done.stdout + done.stderr
    assert 'ok    middleware: rmw' in done.stdout
    assert re.search(r'(ok|note)    ?compiled kernels: \d+ of \d+ modules', done.stdout)
    assert f'image topic: {topics.color} (reliable)' in done.stdout
    assert '-> pop node --camera orbbec' in done.stdout


def test_a_profile_that_does_not_exist_is_bad(tmp_path: Path) -> None:
    missing = str(tmp_path / 'none.xml')
    done = run_doctor(FASTRTPS_DEFAULT_PROFILES_FILE=missing)
    assert f'bad   Fast DDS profile: {missing} does not exist' in done.stdout
    assert done.returncode != 0


def test_without_a_cached_library_the_first_start_is_announced(tmp_path: Path) -> None:
    done = run_doctor(XDG_CACHE_HOME=str(tmp_path))
    assert f'note  pose library: none in {tmp_path}' in done.stdout


def test_cold_caches_and_missing_networks_are_named_with_what_to_do(tmp_path: Path) -> None:
    done = run_doctor(XDG_CACHE_HOME=str(tmp_path), NUMBA_CACHE_DIR=str(tmp_path / 'numba'))
    assert 'note  compiled kernels: 0 of ' in done.stdout
    assert 'the first start compiles the others' in done.stdout
    assert f'note  keypoint networks: none in {tmp_path}' in done.stdout
    assert 'pop models list' in done.stdout


def test_an_unknown_camera_is_refused_with_those_that_are_known() -> None:
    with pytest.raises(CameraPresetError, match=r"realsense.*found 'nikon'"):
        camera_preset('nikon')
