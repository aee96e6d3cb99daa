"""Long runs: what they lose, and whether discs meet as often as they must."""
