"""Fixed Camera Calibration Bench: cases, answers and scores that do not depend on ESC; see README.md."""
