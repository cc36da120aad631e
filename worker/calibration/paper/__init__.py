"""The paper's own method, kept for comparison."""
