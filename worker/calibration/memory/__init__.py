"""Memory of a camera's nights, so that no job is judged as if it were the first."""
