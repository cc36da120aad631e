"""Plans: what cameras would see of a field, and how exactly they could be calibrated, before they are mounted."""
