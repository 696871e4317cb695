"""These tests have a ROS graph of their own."""

from support.ros_graph import log_folder

__all__ = ['log_folder']
