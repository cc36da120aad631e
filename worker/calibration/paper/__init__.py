"""Paper's own method, kept for comparison: its objective on the ground, and no refinement."""
