"""The player: a run as one page that plays it exactly. ``recording`` runs and steps a scene and predicts its
rows, ``page`` writes the differences from the prediction as text, with the style and the script
(``script/``), and ``view`` is the public interface."""

from kinetile.show.player.view import View, view_file, view_scene

__all__ = ["View", "view_file", "view_scene"]
