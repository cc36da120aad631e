"""From near the truth onto it: least squares over measured lines, and how sure that is."""
