"""Errors of clips."""


class VideoError(Exception):
    """No clip comes of it; the message says why, and what to do."""
