"""Pydantic models of the HTTP interface and of files, problems, schedules, and functions that need nothing else."""
