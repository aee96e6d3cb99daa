"""The child of a sandbox: receives tasks, one after the other, and sends the result of each.

Before a check runs on a scene, the child writes the scene to a file, so that it is known if the process does
not survive it; so is the smallest scene known to fail.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from kinetile.errors import BadOption, KinetileError, NotJudged, Refused
from kinetile.kernel.compiled.limits import limit_memory
from kinetile.scene import Scene
from kinetile_conformance.cases import Subject
from kinetile_conformance.checks import check_named
from kinetile_conformance.checks.check import Check, Reference
from kinetile_conformance.deadline import SCENE_SECONDS, limit_scenes
from kinetile_conformance.judge import CheckRun, Judge, verdict
from kinetile_conformance.processes import as_a_child, news_apart
from kinetile_conformance.rehearsal import SAMPLES, compiled, fresh, rehearse, tightness

LAST, FAILING = "last.toml", "failing.toml"
"""Files in the scratch folder: the scene run last, and the last of those that failed."""

NO_MEMORY = 77
"""The exit code of a child that came to the end of its memory."""

Send = Callable[[dict[str, Any]], None]
Task = dict[str, Any]


@dataclass(frozen=True)
class ChildJob:
    """What a child is started for: the phases under test, and how to judge them."""

    name: str
    options: Mapping[str, Any]
    narrow: Mapping[str, Mapping[str, Any]]
    examples: int
    save_to: str | None
    shrink: bool
    seed: int
    seconds: float
    memory: int
    scratch: str
    home: str
    """The folder for Hypothesis's files, instead of the caller's working folder."""

    def as_dict(self) -> dict[str, Any]:
        """Return it, fit for JSON where the options are."""
        return asdict(self)


def serve(job: ChildJob, tasks: Iterable[Task], send: Send) -> None:
    """Carry out tasks until there are no more.

    A task has its kind under "do": "rehearse" (load, compile, run once), "fresh" (list what is still to be
    compiled), "compile" (the samples of numbers "samples"), "judge" (the check "check"; "expected" is why it
    is known to fail), "tightness"; and for the scene run last "alone" (run "check" on it, to see if the
    process survives) and "verdict" (run it under the other phases, to see which one it speaks against). The
    answer to each ends with "done".
    """
    limit_memory(job.memory)
    limit_scenes(SCENE_SECONDS)
    _keep_out(job.home)
    subject = Subject(job.name, job.options, job.narrow)
    scratch = Path(job.scratch)
    judge = Judge(
        subject,
        examples=job.examples,
        seed=job.seed,
        seconds=job.seconds,
        shrink=job.shrink,
        save_to=None if job.save_to is None else Path(job.save_to),
        watched=lambda each: _watched(each, subject, scratch, send),
    )
    for task in tasks:
        match task["do"]:
            case "rehearse":
                try:
                    rehearse(subject)
                except (NotJudged, BadOption, Refused) as error:
                    if _is_out_of_memory(error):
                        os._exit(NO_MEMORY)
                    send({"error": type(error).__name__, "said": str(error)})
            case "fresh":
                send({"fresh": fresh(subject)})
            case "compile":
                for number in task["samples"]:
                    with contextlib.suppress(KinetileError):
                        compiled(subject, SAMPLES[number])
            case "judge":
                result = judge.judge(task["check"], task["expected"])
                paths = {key: str(path) for key in ("case", "picture") if (path := getattr(result, key))}
                send({"result": asdict(result) | paths})
            case "tightness":
                send({"tightness": tightness(subject)})
            case "alone":
                scene, _ = read_scene(scratch / LAST)
                CheckRun(check_named(task["check"]), subject).holds(scene)
            case "verdict":
                scene, _ = read_scene(scratch / LAST)
                send({"verdict": verdict(check_named(task["check"]), subject, scene)})
        send({"done": True})


def read_scene(path: Path) -> tuple[Scene, int]:
    """Return a scene that a child has written, and its index within the check, from 1."""
    from kinetile.scene.by_name import loads_scene

    count, _, text = path.read_text(encoding="utf-8").partition("\n")
    return loads_scene(text), int(count.removeprefix("#"))


def write_scene(path: Path, scene: Scene, count: int) -> None:
    """Write a scene to a file, with its index within the check."""
    from kinetile.scene.files import dumps_scene

    path.write_text(f"# {count}\n{dumps_scene(scene)}", encoding="utf-8")


def _watched(each: Check, subject: Subject, scratch: Path, send: Send) -> Check:
    """Return a check that writes each scene to a file before it runs on it."""
    count = 0

    def run(tested: Subject, scene: Scene, reference: Reference) -> None:
        nonlocal count
        mine = tested.name == subject.name
        if mine:
            count += 1
            write_scene(scratch / LAST, scene, count)
            send({"scene": count})
        try:
            each.run(tested, scene, reference)
        except Refused:
            raise
        except Exception as error:
            if mine:
                if _is_out_of_memory(error):
                    os._exit(NO_MEMORY)
                write_scene(scratch / FAILING, scene, count)
                send({"seen": str(error)})
            raise

    return replace(each, run=run)


def _is_out_of_memory(error: BaseException | None) -> bool:
    """Whether an error, or one that it comes from, is that there is no more memory."""
    while error is not None:
        if isinstance(error, MemoryError):
            return True
        error = error.__cause__ or error.__context__
    return False


def _keep_out(home: str) -> None:
    """Have Hypothesis keep its files in a folder, not in the working folder of this process."""
    from hypothesis.configuration import set_hypothesis_home_dir

    set_hypothesis_home_dir(home)


def main() -> None:
    """Serve in a process of its own: the order is the first line of the standard input, each further line a
    task; messages go to the standard output."""
    news = news_apart()

    def work(tasks: Iterator[Task], send: Send) -> None:
        serve(ChildJob(**next(tasks)), tasks, send)

    as_a_child(work, news, 0)
