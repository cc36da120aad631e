"""Intake of frames, sent or fetched: checked, stored, queued as a job."""
