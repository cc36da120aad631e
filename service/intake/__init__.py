"""Frames on their way in: sent or fetched, looked at, stored, and put into the queue as a job."""
