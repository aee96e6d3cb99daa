"""Certificates: the statements that a proof is made of, and when each of them fails.

Two sorts, which differ in how exact their failure times have to be. ``structural``: a broad phase's
certificates, linear gaps between bounds; their times are rounded, and the skin has room for that. ``contact``
and ``wall``: the failure of "these two are apart", and of "these two overlap". Their ticks are the answer, so
they are the exact floor of the exact root, whatever the doubles: a filter in double decides nearly all of
them, more steps of Newton most of the rest, and ``integers`` all others. docs/specification.md has the
definition, and each module derives its bounds and constants.
"""
