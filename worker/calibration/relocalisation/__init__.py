"""Relocalisation: pose, and focal length where it is unknown, from one frame and the field's markings, without a
start."""
