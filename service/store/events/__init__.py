"""What is told of venues and jobs: the log of events, who follows it, and what is delivered. All SQL about it."""
