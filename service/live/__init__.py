"""Live poses for renderers: OpenTrackIO and FreeD over UDP."""
