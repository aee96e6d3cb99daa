"""Certificates: the statements of a proof, and the ticks of their failures.

``structural``: a broad phase's certificates, linear gaps between bounds; their times are rounded, and the
skin has room for that. ``discs``, ``shapes`` and ``walls``: the failure of "these two are apart", and of
"these two overlap". Their ticks are the answer, so they follow the exact rule, whatever the doubles: a filter
in doubles decides nearly all of them, and ``discs_exactly`` and ``shapes_exactly`` decide the rest, in whole
numbers. docs/specification.md has the definition, and each module derives its bounds and constants.
"""
