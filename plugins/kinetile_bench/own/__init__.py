"""Measurements for a program of one's own: its scene, its frames, and which broad phase to choose."""
