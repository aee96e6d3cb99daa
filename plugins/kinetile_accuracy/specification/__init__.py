"""The contacts of a scene by docs/specification.md, in exact arithmetic, and the check of lists by them."""
