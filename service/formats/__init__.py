"""Poses and lenses in the formats of the tools that use them: cameras in, a file out."""
