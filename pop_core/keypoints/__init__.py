"""2D keypoints of people and their lifting to 3D."""
