"""Exports of a stitched view: maps, weights and lights for other tools, and a picture of it."""
