"""Training of the embedded detector of people in depth images (torch, extra `[train]`)."""
