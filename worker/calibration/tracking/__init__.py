"""Cameras that shake while they film: where each of them was when each frame of a clip was taken."""
