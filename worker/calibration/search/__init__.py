"""Search from stored poses to ones near the truth: an objective for poses, and an evolution strategy."""
