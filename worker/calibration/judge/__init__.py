"""What a result is worth, measured without ground truth, and the gate before it is taken."""
