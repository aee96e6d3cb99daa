"""What happens in a child of the kit: it is given tasks, one after the other, and tells what came of each.

Before a check looks at a scene, the scene is written down, so that it is known if the process does not
survive it; so is the smallest one known to fail.
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
from kinetile_conformance.court.court import Court
from kinetile_conformance.court.limits import SCENE_SECONDS, limit_scenes
from kinetile_conformance.court.rehearsal import SAMPLES, compiled, fresh, rehearse
from kinetile_conformance.court.tightness import tightness
from kinetile_conformance.court.verdicts import Seen, verdict
from kinetile_conformance.isolation.processes import as_a_child, news_apart

__all__ = ["FAILING", "LAST", "NO_MEMORY", "Order", "main", "read_scene", "serve", "write_scene"]

LAST, FAILING = "last.toml", "failing.toml"
"""Files in the scratch folder: the scene looked at last, and the last of those that failed."""

NO_MEMORY = 77
"""The exit code of a child that came to the end of its memory."""

Tell = Callable[[dict[str, Any]], None]
Task = dict[str, Any]


@dataclass(frozen=True)
class Order:
    """Whom a child has to do with, and how."""

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
    """Where Hypothesis keeps what it knows of the source: not in the folder of whoever asks."""

    def as_dict(self) -> dict[str, Any]:
        """Return it, fit for JSON where the options are."""
        return asdict(self)


def serve(order: Order, tasks: Iterable[Task], tell: Tell) -> None:
    """Carry tasks out, until there are no more.

    A task says under "do" what it is: "rehearse" (load, compile, run once), "fresh" (say what is still to be
    compiled), "compile" (the samples of numbers "samples"), "judge" (the check "check"; "expected" is why it
    is known to fail), "tightness"; and for the scene looked at last "alone" (run "check" on it, to see if the
    process survives) and "verdict" (run it under the other phases, to say whom it speaks against). The answer
    to each ends with "done".
    """
    limit_memory(order.memory)
    limit_scenes(SCENE_SECONDS)
    _keep_out(order.home)
    subject = Subject(order.name, order.options, order.narrow)
    scratch = Path(order.scratch)
    court = Court(
        subject,
        examples=order.examples,
        seed=order.seed,
        seconds=order.seconds,
        shrink=order.shrink,
        save_to=None if order.save_to is None else Path(order.save_to),
        watched=lambda each: _watched(each, subject, scratch, tell),
    )
    for task in tasks:
        match task["do"]:
            case "rehearse":
                try:
                    rehearse(subject)
                except (NotJudged, BadOption, Refused) as error:
                    if _is_out_of_memory(error):
                        os._exit(NO_MEMORY)
                    tell({"error": type(error).__name__, "said": str(error)})
            case "fresh":
                tell({"fresh": fresh(subject)})
            case "compile":
                for number in task["samples"]:
                    with contextlib.suppress(KinetileError):
                        compiled(subject, SAMPLES[number])
            case "judge":
                result = court.judge(task["check"], task["expected"])
                paths = {key: str(path) for key in ("case", "picture") if (path := getattr(result, key))}
                tell({"result": asdict(result) | paths})
            case "tightness":
                tell({"tightness": tightness(subject)})
            case "alone":
                scene, _ = read_scene(scratch / LAST)
                Seen(check_named(task["check"]), subject).look(scene)
            case "verdict":
                scene, _ = read_scene(scratch / LAST)
                tell({"verdict": verdict(check_named(task["check"]), subject, scene)})
        tell({"done": True})


def read_scene(path: Path) -> tuple[Scene, int]:
    """Return a scene that a child has written down, and the how manyeth of its check it is."""
    from kinetile.plugin.by_name import loads_scene

    count, _, text = path.read_text(encoding="utf-8").partition("\n")
    return loads_scene(text), int(count.removeprefix("#"))


def write_scene(path: Path, scene: Scene, count: int) -> None:
    """Write a scene down, with the how manyeth of its check it is."""
    from kinetile.scene.text.files import dumps_scene

    path.write_text(f"# {count}\n{dumps_scene(scene)}", encoding="utf-8")


def _watched(each: Check, subject: Subject, scratch: Path, tell: Tell) -> Check:
    """Return a check that writes down what it looks at."""
    count = 0

    def run(on_trial: Subject, scene: Scene, reference: Reference) -> None:
        nonlocal count
        mine = on_trial.name == subject.name
        if mine:
            count += 1
            write_scene(scratch / LAST, scene, count)
            tell({"scene": count})
        try:
            each.run(on_trial, scene, reference)
        except Refused:
            raise
        except Exception as error:
            if mine:
                if _is_out_of_memory(error):
                    os._exit(NO_MEMORY)
                write_scene(scratch / FAILING, scene, count)
                tell({"seen": str(error)})
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
    """Have Hypothesis keep its files in a folder, not in the one that this process happens to stand in."""
    from hypothesis.configuration import set_hypothesis_home_dir

    set_hypothesis_home_dir(home)


def main() -> None:
    """Serve in a process of its own: the order is the first line of the standard input, each further line a
    task; what is told goes to the standard output."""
    news = news_apart()

    def work(tasks: Iterator[Task], tell: Tell) -> None:
        serve(Order(**next(tasks)), tasks, tell)

    as_a_child(work, news, 0)
