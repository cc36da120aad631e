"""The worker: it takes jobs out of the queue, computes each in a process of its own, and looks after what is kept."""
