"""The duties of a worker beside its jobs: webhook delivery, retention, timed alarms and schedules."""
