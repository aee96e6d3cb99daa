"""Scenes: the input of a simulation, as a value, from arrays, recipes or files."""

from kinetile.scene.commands import Accelerate as Accelerate
from kinetile.scene.commands import Command as Command
from kinetile.scene.commands import Insert as Insert
from kinetile.scene.commands import Move as Move
from kinetile.scene.commands import Remove as Remove
from kinetile.scene.commands import SetKind as SetKind
from kinetile.scene.commands import Turn as Turn
from kinetile.scene.responses import Response as Response
from kinetile.scene.scene import Scene as Scene
from kinetile.scene.scene import are_alike as are_alike
from kinetile.scene.scene import relabelled as relabelled
from kinetile.scene.scene import with_commands as with_commands
from kinetile.scene.settings import Settings as Settings
