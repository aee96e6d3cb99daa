"""What the rows of a study come to: a table, fits, figures."""
