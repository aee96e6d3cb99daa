"""Long runs: what they lose, and whether each contact is the one of the specification."""
