"""Shared parts of both kinds of rendering: colours, noise fixed to places in the world, letters."""
