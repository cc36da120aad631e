"""`make bench-cost`: what a job costs, stage by stage, beside what it cost in an earlier release."""
