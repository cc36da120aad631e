"""Plans of cameras that are not mounted yet: view and accuracy."""
