"""Pitches in detail, as one fixed camera of a venue shows them, and crops of these to learn from."""
