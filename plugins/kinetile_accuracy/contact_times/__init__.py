"""Times of contact of two discs: hard families of queries, and answers compared with the exact ticks."""
