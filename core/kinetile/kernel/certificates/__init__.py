"""Certificates: the statements that a proof is made of, and when each of them fails.

``structural``: a broad phase's certificates, linear gaps between bounds; their times are rounded, and the
skin has room for that. ``discs``, ``shapes`` and ``walls``: the failure of "these two are apart", and of
"these two overlap". Their ticks are the answer, so they are those of the exact rule, whatever the doubles: a
filter in double decides nearly all of them, and ``discs_exactly`` and ``shapes_exactly`` what is left, in
whole numbers. docs/specification.md has the definition, and each module derives its bounds and constants.
"""
