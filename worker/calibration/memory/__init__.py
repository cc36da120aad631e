"""Memory of a camera's nights.

With it no job is judged as if it were the first.
"""
