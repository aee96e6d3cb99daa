"""What the thesis says of its benchmark, held against a run of it."""
