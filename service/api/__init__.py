"""Middleware of every request: authentication, rates, sizes, problems as answers."""
