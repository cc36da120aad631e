"""The program that computes one job, and the kinds of jobs."""
