"""The quality gate: which results hold, judged without ground truth, and why the others are refused."""
