"""Diagnostics of a result without ground truth: markings, overlap, registration of pairs, the seam."""
