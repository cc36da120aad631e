"""Middleware and limits around every request: authentication, rates, sizes, and problems as answers."""
