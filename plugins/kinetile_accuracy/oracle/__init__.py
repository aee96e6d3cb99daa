"""The certified oracle: contacts in ball arithmetic, and how far a run agrees with them."""
