"""The rules of a scene, ready to be composed: which hooks respond, and the kernel's table of who meets
whom."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, cast

from kinetile.errors import PhaseError, Refused
from kinetile.kernel.loop.rules import MOST_RESPONSES
from kinetile.kernel.loop.rules import PASS as PASSES
from kinetile.kernel.tables import RULE, Records, record_table
from kinetile.plugin.calling import described
from kinetile.plugin.discovery import Kind
from kinetile.plugin.parts import check_parts
from kinetile.plugin.protocols import BroadPhaseParts, PairParts, ResponseParts, WallParts
from kinetile.scene import Response, Scene
from kinetile.scene.responses import ELASTIC, PASS

__all__ = ["Rules", "read_rules"]

Prepare = Callable[[Kind, str, Mapping[str, Any], Scene], Any]


@dataclass(frozen=True)
class Rules:
    """What happens at contacts, composed.

    Attributes:
        table: the kernel's table of rules.
        kinds: how many kinds of bodies there are.
        hooks: the responses' hooks, in the order of their numbers in the table.
        passing: whether some kinds pass through each other.
        names: the names of the responses in use.
    """

    table: Records
    kinds: int
    hooks: tuple[Callable[..., Any], ...]
    passing: bool
    names: tuple[str, ...]

    def parts(self, pair: PairParts | None, wall: WallParts | None) -> dict[str, Any]:
        """Return what is filled into the loop for them."""
        found: dict[str, Any] = {"RESPONSES": len(self.hooks)}
        found |= {f"respond_{number}": hook for number, hook in enumerate(self.hooks, 1)}
        if pair is not None:
            found |= {"touch": pair.touch, "part": pair.part}
        if wall is not None:
            found["touch_wall"] = wall.touch
        return {name: part for name, part in found.items() if part is not None}


def read_rules(
    scene: Scene,
    broad: tuple[str, BroadPhaseParts],
    narrow: dict[str, PairParts | WallParts],
    prepare: Prepare,
) -> Rules | None:
    """Return the rules of a scene, or None where all contacts are elastic and all bodies can be moved.

    Raises Refused where a phase does not go with them.
    """
    if not scene.ruled:
        return None
    meets = scene.meets
    kinds = len(scene.kinds)
    parts = [_parts(response, scene, prepare) for row in meets for response in row]
    hooks = sorted({each.respond for each in parts if each.respond is not None}, key=_name)
    if len(hooks) > MOST_RESPONSES:
        raise Refused(
            f"a scene can have {MOST_RESPONSES} responses of plugins, and this one has {len(hooks)}"
        )
    rows = record_table(RULE, kinds * (kinds + 1))
    for at, (response, each) in enumerate(zip((each for row in meets for each in row), parts, strict=True)):
        own = (ELASTIC, PASS).index(response.name) if response.name in (ELASTIC, PASS) else None
        rows[at].response = 2 + hooks.index(cast(Any, each.respond)) if own is None else own
        for name, number in zip(RULE.names[1:], each.numbers, strict=False):  # type: ignore[index]
            rows[at][name] = number
    passing = bool((rows.response == PASSES).any())
    if passing and broad[1].solid:
        raise Refused(
            f"{broad[0]} is right only while bodies cannot pass through each other, and this scene has kinds "
            "that pass: choose cells, sap-1d, sap-2d or naive"
        )
    _check_narrow(narrow, passing, bool(hooks))
    names = tuple(dict.fromkeys(response.name for row in meets for response in row))
    return Rules(rows, kinds, tuple(hooks), passing, names)


def _name(hook: Any) -> tuple[str, str]:
    """Where a hook comes from: the same hooks in the same order make the same loop."""
    function = getattr(hook, "py_func", hook)
    return function.__module__, function.__qualname__


def _parts(response: Response, scene: Scene, prepare: Prepare) -> ResponseParts:
    """Return the parts of a response for a scene."""
    parts = prepare("response", response.name, response.options, scene)
    who = described("response", response.name)
    if not isinstance(parts, ResponseParts):
        raise PhaseError(f"{who}: prepare returned {type(parts).__name__}, not ResponseParts")
    check_parts(who, parts)
    if parts.respond is None and response.name not in (ELASTIC, PASS):
        raise PhaseError(f"{who}: its parts have no respond; expected a function marked with toolbox.hook")
    return parts


def _check_narrow(narrow: dict[str, PairParts | WallParts], passing: bool, hooks: bool) -> None:
    """Refuse narrow phases that do not go with rules."""
    for name, parts in narrow.items():
        who = described("narrow phase", name)
        if passing and isinstance(parts, PairParts) and parts.part is None:
            raise Refused(
                f"{who} does not say when two bodies part that pass through each other: it has no part"
            )
        if hooks and parts.touch is None:
            raise Refused(
                f"{who} does not say along which line bodies touch: it has no touch, as responses need"
            )
