"""Checks of calibrations that others made: is it still good on this picture, and if not, why."""
