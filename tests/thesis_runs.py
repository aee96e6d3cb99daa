"""The events of the scenes of docs/thesis, and the files that commands make of them: a program for tests.

It has to run with ``NUMBA_DISABLE_JIT=1``, in one process: these scenes are small, and nothing needs to be
compiled. The package docs/examples/kinetile-thesis must be installed (``installing.install``).

``runs FOLDER SCENE[:PHASE] ...`` prints a JSON object: for each, the state after each event, the start first.
``commands FILE`` runs the lines of a file that begin with ``kinetile``, until one fails.
"""

import json
import shlex
import sys
from pathlib import Path
from typing import Any

from typer.testing import CliRunner

import kinetile as kt
from kinetile.cli import app
from kinetile.errors import AuditError
from kinetile.plugin.choices import read_phase


def moment(sim: kt.Simulation, event: kt.Event | None) -> dict[str, Any]:
    """Returns the present state, after an event; None: at the start."""
    try:
        sim.audit()
        complaint = ""
    except AuditError as error:
        complaint = str(error)

    return {
        "kind": "start" if event is None else event.kind,
        "time": sim.time,
        "tick": sim.exact_time,
        "complaint": complaint,
    }


def happened(scene: kt.Scene, phase: str | None) -> dict[str, Any]:
    """Runs a scene event by event, and returns all moments, and the result."""
    name, options = (None, {}) if phase is None else read_phase(phase)
    sim = kt.Simulation(scene, name, options=options or None)

    moments = [moment(sim, None), *(moment(sim, event) for event in sim.steps())]
    return {"moments": moments, "fingerprint": sim.fingerprint}


def main(what: str, *words: str) -> None:
    """Runs one of the module's two commands."""
    if what == "runs":
        folder, *scenes = words
        found = {}
        for each in scenes:
            name, _, phase = each.partition(":")
            found[each] = happened(kt.load_scene(Path(folder) / f"{name}.toml"), phase or None)
        print(json.dumps(found))
        return
    for line in Path(words[0]).read_text(encoding="utf-8").splitlines():
        if line.startswith("kinetile "):
            result = CliRunner().invoke(app, shlex.split(line)[1:])
            if result.exit_code:
                sys.exit(f"{line}\n{result.stderr}{result.exception!r}")


if __name__ == "__main__":
    main(*sys.argv[1:])
