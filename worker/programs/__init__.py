"""Programs that the service asks for something at once, without a job."""
