"""A run: phases composed into one loop, and the Python around it."""
