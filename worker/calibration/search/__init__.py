"""From stored poses to ones near the truth: what a pose is worth, and the evolution that looks for the best."""
