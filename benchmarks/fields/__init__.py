"""`make bench-fields`: see `__main__`."""
