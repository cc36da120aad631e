"""Tracking of cameras that shake while they film: the pose of each for each frame of a clip."""
