"""Storage: the database, with all SQL of the service, and the files of jobs."""
