"""The child of an isolated runner: receives tasks, one after the other, and sends the result of each.

Before a check runs on a scene, the child sends the scene, so that it is known if the process does not survive
it; so is each scene that fails, with what was said of it. What was sent is not lost, however the child ends.
"""

from __future__ import annotations

import contextlib
import faulthandler
import os
import pickle
import signal
import traceback
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection

from kinetile.errors import BadOption, NotJudged, Refused
from kinetile.kernel.compiled.limits import limit_memory
from kinetile.scene import Scene
from kinetile_conformance.cases import Subject
from kinetile_conformance.checks import check_named
from kinetile_conformance.checks.check import Check, Reference
from kinetile_conformance.deadline import limit_scenes
from kinetile_conformance.processes import Message, sent_through
from kinetile_conformance.runner import CheckRun, How, Runner, verdict
from kinetile_conformance.smoke_test import fresh

NO_MEMORY = 77
"""The exit code of a child that came to the end of its memory."""

Send = Callable[[Message], None]


@dataclass(frozen=True)
class Job:
    """How a child is to run checks."""

    how: How
    scene_seconds: float
    memory: int
    home: str
    """The folder for Hypothesis's files, instead of the caller's working folder."""


def serve(subject: Subject, job: Job, tasks: Iterable[Message], send: Send) -> None:
    """Carry out tasks until there are no more.

    A task has its kind under "do": "smoke test" (load, compile, run once), "fresh" (whether there is
    something to compile), "check" (the check "check"; "expected" is why it is known to fail), "tightness",
    "alone" (run "check" on "scene", to see if the process survives) and "verdict" (run it under the other
    phases, to see which one it speaks against). The answer to each ends with "done".
    """
    limit_memory(job.memory)
    limit_scenes(job.scene_seconds)
    _keep_out(job.home)
    runner = Runner(subject, watched=lambda each: _watched(each, subject, send), **job.how)
    for task in tasks:
        match task["do"]:
            case "smoke test":
                try:
                    runner.smoke_test()
                except (NotJudged, BadOption, Refused) as error:
                    _leave_without_memory(error)
                    send({"error": type(error).__name__, "said": str(error)})
            case "fresh":
                send({"fresh": fresh(subject)})
            case "check":
                send({"result": runner.run(task["check"], task["expected"])})
            case "tightness":
                send({"tightness": runner.tightness()})
            case "alone":
                CheckRun(check_named(task["check"]), subject).holds(task["scene"])
            case "verdict":
                send({"verdict": verdict(check_named(task["check"]), subject, task["scene"])})
            case unknown:
                raise ValueError(f"there is no task {unknown!r}")
        send({"done": True})


def _watched(each: Check, subject: Subject, send: Send) -> Check:
    """Return a check that sends each scene before it runs on it, and again if it fails."""
    count = 0

    def run(tested: Subject, scene: Scene, reference: Reference) -> None:
        nonlocal count
        mine = tested.name == subject.name
        if mine:
            count += 1
            send({"count": count, "scene": pickle.dumps(scene)})
        try:
            each.run(tested, scene, reference)
        except Refused:
            raise
        except Exception as error:
            if mine:
                _leave_without_memory(error)
                send({"seen": str(error), "count": count, "scene": pickle.dumps(scene)})
            raise

    return replace(each, run=run)


def _leave_without_memory(error: BaseException | None) -> None:
    """End this process where an error, or one that it comes from, is that there is no more memory."""
    while error is not None:
        if isinstance(error, MemoryError):
            os._exit(NO_MEMORY)
        error = error.__cause__ or error.__context__


def _keep_out(home: str) -> None:
    """Have Hypothesis keep its files in a folder, not in the working folder of this process."""
    from hypothesis.configuration import set_hypothesis_home_dir

    set_hypothesis_home_dir(home)


def main(number: int) -> None:
    """Serve in a process of its own, through the connection of a number: the job comes first, then tasks."""
    faulthandler.enable(file=2)
    if hasattr(signal, "SIGXCPU"):
        faulthandler.register(signal.SIGXCPU, file=2, chain=True)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with contextlib.suppress(ImportError, ValueError):
        import resource

        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    link = Connection(number)
    try:
        phases, job = link.recv()
    except Exception as error:  # whatever unpickling a foreign phase comes to
        said = f"the phase cannot be loaded in a process of its own ({error}): judge it in this process"
        link.send({"error": "Refused", "said": said})
        return
    try:
        serve(phases.register(), job, sent_through(link), link.send)
    except Exception as error:  # what a phase raises is a result: this is an error of the kit
        _leave_without_memory(error)
        link.send({"trace": traceback.format_exc()})
        raise
