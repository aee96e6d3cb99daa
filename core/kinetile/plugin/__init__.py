"""Plugins: what they offer, the protocols that they follow, and the registry that finds them by name."""
