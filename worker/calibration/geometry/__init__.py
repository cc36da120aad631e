"""What a calibration is about: cameras, the pitch, the ground, and what of it is in view."""
