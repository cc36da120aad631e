"""Services in real processes, their homes, stub cameras and rendered venues, which tests and benchmarks share."""
