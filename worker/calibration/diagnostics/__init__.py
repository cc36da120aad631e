"""Diagnostics of a result: markings, overlap, pairs, the seam."""
