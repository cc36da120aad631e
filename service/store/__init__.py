"""What is kept: the database with all SQL, and the files."""
