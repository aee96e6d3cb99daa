"""The certified oracle: contacts that are certain, and how far a run agrees with them."""
