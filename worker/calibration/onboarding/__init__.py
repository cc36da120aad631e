"""Onboarding: a lens from photos of a board, a pose from clicked points."""
