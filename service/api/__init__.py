"""What surrounds every request: who may ask, how often and how much, and how an answer looks."""
