"""The stitched view: what it shows, where each of its pixels lies in the frames, and how frames become one picture."""
