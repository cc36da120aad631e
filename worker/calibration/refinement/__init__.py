"""Refinement: poses onto measured lines by least squares, with covariances."""
