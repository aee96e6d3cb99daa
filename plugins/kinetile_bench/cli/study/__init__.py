"""``kinetile study``: run a table of scenes, phases and seeds, see how it stands, read it, draw it."""
