"""What can be wrong with clips."""


class VideoError(Exception):
    """No clip comes of it; the message says why, and what to do."""
