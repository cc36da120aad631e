"""Plans of cameras that are not mounted yet: what they would see of a field, and how exactly a calibration would be."""
