"""Hard cases of the contact time of two discs."""
