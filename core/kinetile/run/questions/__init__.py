"""Questions about a moment: who is where, who is next to whom, who will meet whom.

Every answer is a function of the flight plans and of the present tick, of nothing else: no question looks at
what a broad phase keeps or at what the queue has found out so far. So answers are the same under every phase,
and asking changes nothing.

They are exact, in one of two senses. *When* two bodies meet is asked of the narrow phase as the loop asks it:
the answer is the tick that the contact will have in the log (``meetings``). *Where* bodies are now is known
in doubles, those of ``Simulation.positions``; taken at their word, with the radii and the numbers of the
question, they leave no room for opinion: a disc touches a box or it does not (``places``, ``rays``). A filter
in floating point decides nearly all, and leaves whatever its roundings could have touched to whole numbers of
any size (``exact``).

All functions take a ``Moment``, which names the slots of the bodies that are asked about: all that live, or
those that somebody knows to be enough. They answer in slots. ``Questions`` is what a simulation is asked, in
the numbers that its bodies have for the user.
"""

from __future__ import annotations

from kinetile.run.questions.meetings import CastHit, NextContact
from kinetile.run.questions.moment import Moment
from kinetile.run.questions.questions import Questions
from kinetile.run.questions.rays import RayHit

__all__ = ["CastHit", "Moment", "NextContact", "Questions", "RayHit"]
