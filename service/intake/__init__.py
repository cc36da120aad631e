"""Intake of frames: they are sent or fetched, checked, stored, and queued as a job."""
