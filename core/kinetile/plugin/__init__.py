"""The seam: what plugins are told and what they bring, and whatever is found by name."""
