"""What a simulation models and what it leaves out, in sentences: the compiled loop contains the first and
nothing of the rest."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from kinetile.kernel.loop import idle
from kinetile.kernel.skin import Skin
from kinetile.run.composition import Commands, Composition
from kinetile.scene import Insert, Remove, Scene, Turn

__all__ = ["explanation", "explanation_lines"]

_UNITS = {
    "time_unit": "of the scene's time",
    "tick": "of the scene's time",
    "speed_bound": "length / time",
    "skin": "length",
    "skin_in_radii": "of the smallest radius",
    "structural_error": "length",
}


def explanation(
    scene: Scene, composition: Composition, commands: Commands, skin: Skin, time_unit: float, speed: float
) -> dict[str, Any]:
    """Return {"modelled": sentences, "left out": sentences, "numbers": {name: value}}."""
    modelled = [f"{len(scene)} discs, flying straight between contacts"]
    rules = composition.rules
    left_out = ["gravity, friction, rotation, growth" + (" and any loss of energy" if rules is None else "")]
    options = ", ".join(f"{name}={value}" for name, value in composition.options.items())
    certificates = 0 if composition.broad.repair is idle.repair else len(scene)
    modelled.append(
        f"candidate pairs by the broad phase {composition.broad_phase}{f' ({options})' if options else ''}, "
        f"with {'one structural certificate a body' if certificates else 'no structural certificate'}"
    )
    role = {"pair": composition.pair is not None, "wall": composition.wall is not None}
    equal = len(scene) == 0 or bool((scene.mass == scene.mass[0]).all())
    named = ", ".join(composition.narrow_phases) or "none"
    if role["pair"]:
        modelled.append(f"contacts of two bodies (narrow phases: {named})")
        (left_out if equal else modelled).append(
            "masses: all are equal"
            if equal
            else f"masses from {float(scene.mass.min())!r} to {float(scene.mass.max())!r}"
        )
    else:
        left_out.append("contacts of two bodies: no narrow phase for pairs is named")
    if rules is not None:
        kinds = f"{rules.kinds} {'kind' if rules.kinds == 1 else 'kinds'} of bodies"
        modelled.append(f"responses by kind: {', '.join(rules.names)}, for {kinds} and the walls")
    else:
        left_out.append("responses by kind: every contact is elastic")
    if role["wall"] and scene.arena is not None:
        modelled.append(
            f"four walls around {scene.arena[0]!r} x {scene.arena[1]!r}, one contact of each body awaited"
        )
    elif scene.arena is not None:
        left_out.append("walls: the scene has an arena, but no narrow phase for walls is named")
    else:
        left_out.append("walls: the scene has no arena")
    if commands:
        modelled.append(f"commands: {_counted(scene)} in the scene, and those given by hand")
        if commands == Commands.ALL and not composition.living:
            left_out.append("taking bodies in and letting them go: for each the broad phase is built anew")
    else:
        left_out.append("commands (turns, insertions, removals): the scene has none")
    return {
        "modelled": modelled,
        "left out": left_out,
        "numbers": {
            "bodies": len(scene),
            "structural_certificates": certificates,
            "time_unit": time_unit,
            "tick": time_unit * 2.0**-52,
            "speed_bound": speed,
            "skin": skin.delta,
            "skin_in_radii": skin.delta / float(scene.radius.min()) if len(scene) else 0.0,
            "structural_error": skin.eta,
        },
    }


def explanation_lines(found: Mapping[str, Any]) -> list[str]:
    """Return ``Simulation.explain()`` as lines of text: each list under its heading, then the numbers."""
    lines: list[str] = []
    for heading, content in found.items():
        lines.append(f"{heading}:")
        if isinstance(content, Mapping):
            width = max(map(len, content), default=0)
            for name, value in content.items():
                shown = f"{value:.6g}" if isinstance(value, float) else f"{value:,}"
                label = name.replace("_", " ")
                lines.append(f"  {label:{width}}  {shown} {_UNITS.get(name, '')}".rstrip())
        else:
            lines += [f"  - {sentence}" for sentence in content]
    return lines


def _counted(scene: Scene) -> str:
    """Return how many commands of each kind there are."""
    kinds = (("turns", Turn), ("insertions", Insert), ("removals", Remove))
    return ", ".join(f"{sum(isinstance(c, kind) for c in scene.commands)} {name}" for name, kind in kinds)
