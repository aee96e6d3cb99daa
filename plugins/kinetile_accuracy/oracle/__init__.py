"""The certified oracle: contacts in ball arithmetic, and the agreement of runs with them."""
