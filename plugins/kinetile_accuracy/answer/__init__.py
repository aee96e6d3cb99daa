"""The answer of a scene by docs/specification.md, in exact arithmetic, and lists checked against it."""
