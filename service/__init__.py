"""The HTTP service: what it is asked, what it keeps, and what its worker and its clients share with it."""
