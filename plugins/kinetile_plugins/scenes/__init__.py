"""Recipes for scenes: each is a function whose keyword arguments are the scene's parameters."""
