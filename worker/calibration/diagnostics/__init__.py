"""Reports on a result, measured without ground truth: markings, overlap, registration of pairs, the seam."""
