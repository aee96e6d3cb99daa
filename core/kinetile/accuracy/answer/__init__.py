"""The answer of a scene by docs/specification.md, in exact arithmetic, and the checking of lists against it."""
