"""From frames to evidence: which pixels are lines, and where exactly these run."""
