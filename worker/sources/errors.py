"""Why a camera gave no picture and no stream."""


class CameraError(Exception):
    """A camera gave no picture or stream; the message says why in words, and what to do."""
