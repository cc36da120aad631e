"""Onboarding before the first calibration: a lens from photos of a board, a pose from clicked points."""
