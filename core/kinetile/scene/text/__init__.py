"""What a scene file says: its syntax, its keys and types, its commands."""
