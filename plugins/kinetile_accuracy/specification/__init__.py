"""The contacts of a scene by docs/specification.md, in exact arithmetic, and lists checked against them."""
