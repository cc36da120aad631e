"""Logs, metrics, traces, readiness and free disk space, for the operator."""
