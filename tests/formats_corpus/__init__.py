"""Calibration files of other tools, with the pixels at which these tools see points."""
