"""Programs that compute answers to requests at once, without a job, since the API has no NumPy."""
