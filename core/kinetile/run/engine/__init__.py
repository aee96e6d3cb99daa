"""The engine, and what computes for it: tables, bounds, commands, contacts, errors."""
