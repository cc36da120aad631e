"""Pydantic models of the HTTP interface and of files."""
