"""Certificates: the statements that a proof is made of, and when each of them fails.

``structural``: a broad phase's certificates, linear gaps between bounds; their times are rounded, and the
skin has room for that. ``contact`` and ``wall``: the failure of "these two are apart", and of "these two
overlap". Their ticks are the answer, so they are the exact floor of the exact root, whatever the doubles: a
filter in double decides nearly all of them, and ``integers`` what is left. docs/specification.md has the
definition, and each module derives its bounds and constants.
"""
