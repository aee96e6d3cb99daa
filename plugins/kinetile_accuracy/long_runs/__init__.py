"""Long runs: their losses, and a check of each contact against the specification."""
