"""Duties of a worker beside its jobs: webhooks, retention, alarms, schedules."""
