"""Geometry: cameras, lenses, field, ground, projection, visibility."""
