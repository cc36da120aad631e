"""Logs, metrics, traces, readiness and free disk space."""
