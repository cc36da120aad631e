"""Poses and lenses in the formats of other tools."""
