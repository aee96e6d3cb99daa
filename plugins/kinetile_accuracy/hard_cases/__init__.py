"""Hard cases of the question when two discs meet."""
