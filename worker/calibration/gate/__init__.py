"""The quality gate: which results are accepted, without ground truth."""
