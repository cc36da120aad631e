"""`esc`: the command line."""
