"""The commands, a file a command: how it is called, and what it does."""
