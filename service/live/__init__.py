"""Poses where renderers listen: OpenTrackIO and FreeD over UDP, at the rate of the pictures."""
