"""The numerical core: RGB-D frames in, fitted bodies out; no ROS, no prints, no clocks."""
