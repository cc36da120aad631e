"""Tracking of cameras that shake: a pose for each frame of a clip."""
