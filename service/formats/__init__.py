"""Poses and lenses in the formats of other tools, written and read."""
