"""Checks of calibrations that others made: still good, and if not, why."""
