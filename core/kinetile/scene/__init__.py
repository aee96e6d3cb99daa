"""Scenes: the input of a simulation, as a value, from arrays, recipes or files."""

from __future__ import annotations

from kinetile.scene.commands import Command, Insert, Remove, Turn
from kinetile.scene.responses import Response
from kinetile.scene.scene import Scene, Settings, only_turns, relabelled, spacious, standing, with_commands

__all__ = [
    "Command",
    "Insert",
    "Remove",
    "Response",
    "Scene",
    "Settings",
    "Turn",
    "only_turns",
    "relabelled",
    "spacious",
    "standing",
    "with_commands",
]
