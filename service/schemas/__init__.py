"""What crosses HTTP and files: models, problems, schedules, and what is computed of them alone."""
