"""What can be wrong with clips."""


class VideoFault(Exception):  # noqa: N818
    """No clip comes of it; the message says why, and what to do."""
