"""What is kept of the nights of a camera, so that no job is judged as if it were the first."""
