"""Saving a run: ``snapshot`` holds what it is at one moment, ``files`` writes that down and reads it."""
