"""Plugins: specs, protocols, and the registry that finds plugins by name."""
