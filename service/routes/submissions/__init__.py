"""Pictures and clicks in, a job out, a kind of job each."""
