"""The stripes broad phase, as kinetile finds it; its own module is imported when somebody selects it."""

import kinetile as kt

__all__ = ["kinetile_broad_phases"]


@kt.hookimpl
def kinetile_broad_phases() -> list[kt.BroadPhaseSpec]:
    """Names the broad phase that this package brings."""
    summary = "vertical stripes: bodies in the same stripe or in neighbouring ones are near each other"
    return [kt.BroadPhaseSpec("stripes", "kinetile_stripes.stripes:Stripes", summary, api=2)]
