"""Clips of a venue's cameras become one clip of the stitched view: read, put in time, rendered, written.

Needs the extra `video` (PyAV), which is imported where a clip is opened or written.
"""
