"""kinetile: kinetic broad-phase collision detection in 2D, as a kernel with pluggable phases.

The names below are the whole public interface; each is imported at its first use, and so are the packages and
``kinetile.errors``: ``import kinetile`` stays light.
"""

import sys
from importlib import import_module
from typing import TYPE_CHECKING, Any

from kinetile.lazy import lazy_names
from kinetile.versions import __version__ as __version__

if TYPE_CHECKING:
    from kinetile.comparison import compare as compare
    from kinetile.kernel.log import ANSWER as ANSWER
    from kinetile.kernel.log import CONTACT as CONTACT
    from kinetile.kernel.log import LOG as LOG
    from kinetile.plugin.registry import Registry as Registry
    from kinetile.plugin.registry import registry as registry
    from kinetile.plugin.specs import API_VERSION as API_VERSION
    from kinetile.plugin.specs import BroadPhaseSpec as BroadPhaseSpec
    from kinetile.plugin.specs import NarrowPhaseSpec as NarrowPhaseSpec
    from kinetile.plugin.specs import ObservableSpec as ObservableSpec
    from kinetile.plugin.specs import ResponseSpec as ResponseSpec
    from kinetile.plugin.specs import SceneSpec as SceneSpec
    from kinetile.plugin.specs import hookimpl as hookimpl
    from kinetile.records.encounters import encounters as encounters
    from kinetile.records.frames import frames as frames
    from kinetile.records.reading import read_events as read_events
    from kinetile.records.recorder import EventRecorder as EventRecorder
    from kinetile.records.trajectory import Trajectory as Trajectory
    from kinetile.run.advance import Ended as Ended
    from kinetile.run.advance import Event as Event
    from kinetile.run.arguments import StopAt as StopAt
    from kinetile.run.asked import distance as distance
    from kinetile.run.moment import Moment as Moment
    from kinetile.run.moment import Recorder as Recorder
    from kinetile.run.observing import Collisions as Collisions
    from kinetile.run.observing import Observable as Observable
    from kinetile.run.questions.meetings import CastHit as CastHit
    from kinetile.run.questions.meetings import NextContact as NextContact
    from kinetile.run.questions.places import RayHit as RayHit
    from kinetile.run.saving.snapshot import Snapshot as Snapshot
    from kinetile.run.simulation import Inserted as Inserted
    from kinetile.run.simulation import Progress as Progress
    from kinetile.run.simulation import Simulation as Simulation
    from kinetile.run.simulation import resume as resume
    from kinetile.scene import Accelerate as Accelerate
    from kinetile.scene import Insert as Insert
    from kinetile.scene import Move as Move
    from kinetile.scene import Remove as Remove
    from kinetile.scene import Response as Response
    from kinetile.scene import Scene as Scene
    from kinetile.scene import SetKind as SetKind
    from kinetile.scene import Settings as Settings
    from kinetile.scene import Turn as Turn
    from kinetile.scene.by_name import make_scene as make_scene
    from kinetile.scene.files import load_scene as load_scene
    from kinetile.scene.files import save_scene as save_scene
    from kinetile.scene.scene import with_obstacles as with_obstacles
    from kinetile.scene.shapes import Obstacle as Obstacle
    from kinetile.scene.shapes import Shape as Shape
    from kinetile.scene.shapes import box as box
    from kinetile.scene.shapes import capsule as capsule
    from kinetile.scene.shapes import convex_parts as convex_parts
    from kinetile.scene.shapes import disc as disc
    from kinetile.scene.shapes import polygon as polygon
    from kinetile.scene.shapes import polyline as polyline
    from kinetile.scene.shapes import segment as segment
    from kinetile.show.film import film as film
    from kinetile.show.html import as_html as as_html
    from kinetile.show.html import as_svg as as_svg
    from kinetile.show.player.view import view as view
    from kinetile.show.printed import plot as plot

_NAMES, _attribute = lazy_names(__name__)
_MODULES = ("errors", "kernel", "plugin", "records", "run", "scene", "show", "toolbox")

__all__ = [*_NAMES, "__version__"]


def __getattr__(name: str) -> Any:
    return import_module(f"kinetile.{name}") if name in _MODULES else _attribute(name)


def __dir__() -> list[str]:
    return [*__all__, *_MODULES]


if "IPython" in sys.modules:
    from kinetile.show.notebook import register_where_ipython_runs

    register_where_ipython_runs()
