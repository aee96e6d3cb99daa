"""A moment of a run as a picture: the bodies, and what the broad phase says there is to see.

``moment`` takes the picture, with every shape where it is at that moment; ``looks`` says how each role looks;
``svg`` writes it, for pages, and ``printed`` draws it with matplotlib, for paper. The same picture gives the
same bytes.
"""

from __future__ import annotations

from kinetile.show.picture.moment import Picture, picture_of_scene, take_picture
from kinetile.show.picture.printed import as_printed
from kinetile.show.picture.svg import as_svg

__all__ = ["Picture", "as_printed", "as_svg", "picture_of_scene", "take_picture"]
