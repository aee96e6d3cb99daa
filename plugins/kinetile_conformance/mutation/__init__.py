"""Mutation: a phase with one thing changed at a time, to find what its author's tests and the kit miss."""
