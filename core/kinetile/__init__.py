"""kinetile: kinetic broad-phase collision detection in 2D, as a kernel with pluggable phases.

The names below are the whole public surface; each is imported when it is first used, so that
``import kinetile`` stays light.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from kinetile._registry import Registry as Registry
    from kinetile._registry import registry as registry
    from kinetile.hookspecs import hookimpl as hookimpl
    from kinetile.log import CONTACT as CONTACT
    from kinetile.log import LOG as LOG
    from kinetile.recipes import make_scene as make_scene
    from kinetile.records import EventRecorder as EventRecorder
    from kinetile.records import read_events as read_events
    from kinetile.scene import Scene as Scene
    from kinetile.scene import Settings as Settings
    from kinetile.scene import Turn as Turn
    from kinetile.scene_files import load_scene as load_scene
    from kinetile.scene_files import save_scene as save_scene
    from kinetile.simulation import Progress as Progress
    from kinetile.simulation import Simulation as Simulation
    from kinetile.specs import API_VERSION as API_VERSION
    from kinetile.specs import BroadPhaseSpec as BroadPhaseSpec
    from kinetile.specs import NarrowPhaseSpec as NarrowPhaseSpec
    from kinetile.specs import SceneSpec as SceneSpec
    from kinetile.trajectory import Trajectory as Trajectory

__version__ = "0.1.0"

_HOME = {
    "API_VERSION": "kinetile.specs",
    "BroadPhaseSpec": "kinetile.specs",
    "CONTACT": "kinetile.log",
    "LOG": "kinetile.log",
    "NarrowPhaseSpec": "kinetile.specs",
    "EventRecorder": "kinetile.records",
    "Progress": "kinetile.simulation",
    "Trajectory": "kinetile.trajectory",
    "read_events": "kinetile.records",
    "Registry": "kinetile._registry",
    "Scene": "kinetile.scene",
    "SceneSpec": "kinetile.specs",
    "Settings": "kinetile.scene",
    "Simulation": "kinetile.simulation",
    "Turn": "kinetile.scene",
    "hookimpl": "kinetile.hookspecs",
    "load_scene": "kinetile.scene_files",
    "make_scene": "kinetile.recipes",
    "registry": "kinetile._registry",
    "save_scene": "kinetile.scene_files",
}

__all__ = [*sorted(_HOME), "__version__"]


def __getattr__(name: str) -> Any:
    if name in ("accuracy", "conformance"):
        return import_module(f"kinetile.{name}")
    if name in _HOME:
        return getattr(import_module(_HOME[name]), name)
    raise AttributeError(f"module 'kinetile' has no attribute {name!r}")


def __dir__() -> list[str]:
    return __all__
