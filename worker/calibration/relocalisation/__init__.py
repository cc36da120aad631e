"""Relocalisation: pose and focal length from one frame, without a start."""
