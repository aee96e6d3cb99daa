"""The engine, and its parts: tables, bounds, commands, contacts, errors."""
