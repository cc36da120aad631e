"""What an operator watches: logs, metrics, traces, whether all is there, and room on the disk."""
