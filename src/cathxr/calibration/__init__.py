"""From pictures of boards and fiducials to a Rig: lenses, poses, timing, each with its error. Pure functions."""
