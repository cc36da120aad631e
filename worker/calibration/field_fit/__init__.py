"""Fit of a field's measures to the lines that its cameras see."""
