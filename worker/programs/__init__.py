"""Programs that the service runs at once, without a job."""
