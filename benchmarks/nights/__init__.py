"""`make bench-truth ONLY=nights`: sequences of jobs, each of which begins where the last one ended."""
