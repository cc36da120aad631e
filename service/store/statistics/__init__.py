"""What the database counts and sums up for whoever watches the service."""
