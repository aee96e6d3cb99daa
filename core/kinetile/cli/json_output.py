"""Results as JSON, for programs."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from kinetile.scene import Scene

__all__ = ["as_json", "scene_summary"]


def scene_summary(scene: Scene) -> dict[str, Any]:
    """Return where a scene comes from and how large it is, in plain types."""
    return {
        "file": scene.origin.get("file"),
        "recipe": scene.origin.get("recipe"),
        "parameters": dict(scene.origin.get("parameters", {})),
        "bodies": len(scene),
        "arena": scene.arena and list(scene.arena),
        "start": scene.start,
        "turns": len(scene.turns),
    }


def as_json(result: Any) -> str:
    """Return a result as JSON text; JSON has no numbers that are not finite: they become null."""
    return json.dumps(_plain(result), indent=2, allow_nan=False)


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple | set | frozenset):
        return [_plain(item) for item in value]
    if isinstance(value, float):
        return float(value) if abs(value) < float("inf") else None
    return value if value is None or isinstance(value, str | int) else str(value)
