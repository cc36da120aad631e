"""Statistics in the database: counters, histories and summaries, for pages and /metrics."""
