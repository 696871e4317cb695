"""Parts of the build of the default body; each needs the build-time packages only."""
