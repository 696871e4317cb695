"""Where all joints of a person are, said by a network that sees depth around the keypoints."""
