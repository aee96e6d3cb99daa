"""The smoke test before all checks.

It loads a phase, compiles its loop and runs one scene of two bodies. What fails there is no
matter of conformance: it is said once, with the author's own file and line, and nothing is judged.
"""

from __future__ import annotations

import math
from contextlib import suppress

from kinetile import box, capsule
from kinetile.errors import BadOption, KinetileError, MissingExtra, NotJudged, Refused, UnknownName
from kinetile.scene import Scene, Settings
from kinetile_conformance.cases import Subject
from kinetile_conformance.deadline import begin_scene

_TWO = Scene(
    [[1.0, 1.0], [3.0, 1.25]],
    [[1.0, 0.5], [-1.0, 0.0]],
    [0.5, 0.5],
    arena=(4.0, 4.0),
    settings=Settings(until=2.0),
)
SAMPLES = (
    *(
        _TWO.replace(radius=[0.5, least], arena=arena)
        for arena in ((4.0, 4.0), None)
        for least in (0.5, 2**-6)
    ),
    *(
        _TWO.replace(shape=shape, velocity=[[1.0, 0.5], [0.0, 0.0]], mass=[1.0, math.inf])
        for shape in (capsule((-0.25, 0.0), (0.25, 0.0), 0.25), box(1.0, 1.0))
    ),
)
"""Two bodies: discs, capsules, and squares."""


def smoke_test(subject: Subject) -> None:
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
            _run(subject, scene)
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


def _run(subject: Subject, scene: Scene) -> None:
    """Compile a phase, and run it once."""
    sim = subject.simulation(scene)
    sim.compile()
    with suppress(KinetileError):
        sim.run()
        sim.audit()
