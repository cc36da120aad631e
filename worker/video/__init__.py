"""Clips of a venue's cameras become one clip of the stitched view.

Needs the extra `video` (PyAV), which is imported where a clip is opened or written.
"""
