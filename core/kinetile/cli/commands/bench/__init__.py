"""The commands ``kinetile bench ...``, a file a command."""
