"""Saving a run: ``snapshot`` holds its state at one moment, ``files`` writes and reads it."""
