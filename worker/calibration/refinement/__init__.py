"""Refinement: poses from near the truth onto measured lines by least squares, with covariances."""
