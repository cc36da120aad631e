"""Stitching: the view, the place of each of its pixels in the frames, and the picture of several frames."""
