"""Query accuracy: when two discs meet, asked in hard families and judged exactly."""
