"""Storage: the database, with all SQL, and the files of jobs."""
