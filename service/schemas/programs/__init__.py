"""Messages between the service and its child programs."""
