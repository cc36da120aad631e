"""Programs beside the API that are asked for something at once, without a job: what needs NumPy."""
