"""The numerical core: RGB-D frames in, fitted bodies out; no ROS, no prints, no clocks."""

__version__ = '0.1.0'
