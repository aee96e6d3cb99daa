"""What a notebook shows of an object by itself: a small table, and the picture of the moment beside it.

``tables`` writes tables as HTML; rooms above this one make their displays of them. ``things`` says what
there is to see of a scene, a simulation and readings. A display takes no colour of its own, so it is as
readable on a dark page as on a light one; it stays small, however many bodies there are, and says what it
leaves out; and it raises nothing.
"""

from __future__ import annotations

__all__: list[str] = []
