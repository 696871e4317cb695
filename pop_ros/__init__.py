"""The ROS 2 package: node, messages, replay and command line."""
