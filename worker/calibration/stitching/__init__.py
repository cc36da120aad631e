"""Stitching: the view, the maps of its pixels, the picture of several frames."""
