"""What comes before any check: a phase is loaded, its loop is compiled, and it runs one scene.

What is wrong by then is no matter of conformance: a module with a syntax error, a hook that the compiler
refuses, a part of it that raises. It is said once, with the author's own file and line, and nothing is
judged.

The samples are two bodies each, with walls and without, of one size and of two: the choices for which loops
differ. A conformance run compiles these and no others, but for what a phase itself composes otherwise.
"""

from __future__ import annotations

from contextlib import suppress

from kinetile.errors import BadOption, KinetileError, MissingExtra, NotJudged, Refused, UnknownName
from kinetile.scene import Scene, Settings
from kinetile_conformance.cases import REFERENCE, Subject
from kinetile_conformance.court.limits import begin_scene

__all__ = ["SAMPLES", "compiled", "fresh", "rehearse"]


def _sample(radius: float, arena: tuple[float, float] | None) -> Scene:
    return Scene(
        [[1.0, 1.0], [3.0, 1.25]],
        [[1.0, 0.5], [-1.0, 0.0]],
        [0.5, radius],
        arena=arena,
        settings=Settings(until=2.0),
    )


SAMPLES = tuple(_sample(radius, arena) for arena in ((4.0, 4.0), None) for radius in (0.5, 0.015625))


def rehearse(subject: Subject) -> None:
    """Load a phase, compile it for the first sample that it does not refuse, and run it on that.

    What becomes of the run is a matter of the checks.

    Raises:
        NotJudged: it does not load, a part of it raises, or its hooks do not compile.
        UnknownName, BadOption: there is no such phase, or it has no such option.
        Refused: it refuses all samples.
    """
    refusal: Refused | None = None
    for scene in SAMPLES:
        begin_scene()
        try:
            compiled(subject, scene)
        except Refused as error:
            refusal = refusal or error
        except (UnknownName, BadOption, MissingExtra):
            raise
        except KinetileError as error:
            raise NotJudged(str(error)) from error
        else:
            return
    assert refusal is not None
    raise refusal


def fresh(subject: Subject) -> list[int]:
    """Return the numbers of the samples for which something is still to be compiled."""
    return [number for number, scene in enumerate(SAMPLES) if _is_fresh(subject, scene)]


def _is_fresh(subject: Subject, scene: Scene) -> bool:
    try:
        return any(each.simulation(scene).cached is False for each in (subject, subject.under(REFERENCE)))
    except KinetileError:
        return False


def compiled(subject: Subject, scene: Scene) -> None:
    """Compile all that a check may ask of a phase, and of the reference, on such a scene; run it once."""
    for each in (subject, subject.under(REFERENCE)):
        sim = each.simulation(scene)
        sim.compile()
        with suppress(KinetileError):
            sim.run()
            sim.audit()
