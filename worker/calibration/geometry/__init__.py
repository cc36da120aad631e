"""Geometry of a calibration: cameras, lenses, field, ground, projection and visibility."""
