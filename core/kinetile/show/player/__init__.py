"""The player: a run as one page that plays it exactly, moment by moment and event by event.

``recording`` runs and steps a scene, ``plans`` says what of its rows can be foretold, ``columns`` makes text
of the rest, ``page`` puts it together with the style and the script (``script/``), and ``view`` is what users
call.
"""

from __future__ import annotations

from kinetile.show.player.view import View, view_file, view_scene

__all__ = ["View", "view_file", "view_scene"]
