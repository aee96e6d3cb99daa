"""What happens in a child of the kit: checks, one after the other, each told when it begins and what came of
it.

Before a check looks at a scene, the scene is written down, so that it is known if the process does not
survive it; so is the smallest one known to fail.
"""

from __future__ import annotations

import contextlib
import json
import os
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from kinetile.conformance.cases import Subject
from kinetile.conformance.checks import check_named
from kinetile.conformance.checks.check import Check, Reference
from kinetile.conformance.checks.gallery import smallest
from kinetile.conformance.checks.tightness import tightness
from kinetile.conformance.checks.verdicts import Seen, verdict
from kinetile.conformance.engine import run_check
from kinetile.errors import BadOption, KinetileError, Refused
from kinetile.scene import Scene

__all__ = ["FAILING", "LAST", "NO_MEMORY", "Order", "main", "read_scene", "work", "write_scene"]

LAST, FAILING = "last.toml", "failing.toml"
"""Files in the scratch folder: the scene looked at last, and the last of those that failed."""

NO_MEMORY = 77
"""The exit code of a child that came to the end of its memory."""

Tell = Callable[[dict[str, Any]], None]


@dataclass(frozen=True)
class Order:
    """What a child is to do.

    It runs ``checks``, and the ``first`` child sees before that whether the phase takes its options and does
    any scene at all. Two orders are for the scene looked at last only: ``alone`` is a check to run on it, and
    to be told if the process survives; ``verdict`` is one to run under the other phases, to say whom it
    speaks against.
    """

    name: str
    options: Mapping[str, Any]
    checks: tuple[str, ...]
    examples: int
    expected: Mapping[str, str]
    save_to: str | None
    shrink: bool
    seed: int
    memory: int
    scratch: str
    tightness: bool
    first: bool = True
    alone: str | None = None
    verdict: str | None = None

    def as_dict(self) -> dict[str, Any]:
        """Return it, fit for JSON where the options are."""
        return asdict(self)


def work(order: Order, tell: Tell) -> None:
    """Carry an order out."""
    _limit_memory(order.memory)
    subject = Subject(order.name, order.options)
    scratch = Path(order.scratch)
    if order.verdict is not None:
        scene, _ = read_scene(scratch / LAST)
        tell({"verdict": verdict(check_named(order.verdict), subject, scene)})
        return
    if order.alone is not None:
        scene, _ = read_scene(scratch / LAST)
        Seen(check_named(order.alone), subject).look(scene)
        tell({"alive": True})
        return
    if order.first:
        try:
            subject.simulation(smallest())
        except (BadOption, Refused) as error:
            tell({"error": type(error).__name__, "said": str(error)})
            return
        except KinetileError:
            pass  # what is wrong with it the checks will say
    fine = True
    save_to = None if order.save_to is None else Path(order.save_to)
    for name in order.checks:
        tell({"begin": name})
        result = run_check(
            _watched(check_named(name), subject, scratch, tell),
            subject,
            order.examples,
            order.expected.get(name),
            save_to,
            order.shrink,
            order.seed,
        )
        fine = fine and result.ok
        paths = {key: str(path) for key in ("case", "picture") if (path := getattr(result, key)) is not None}
        tell({"result": asdict(result) | paths})
    tell({"end": True, "tightness": tightness(subject) if fine and order.tightness else None})


def read_scene(path: Path) -> tuple[Scene, int]:
    """Return a scene that a child has written down, and the how manyeth of its check it is."""
    from kinetile.plugin.by_name import loads_scene

    count, _, text = path.read_text(encoding="utf-8").partition("\n")
    return loads_scene(text), int(count.removeprefix("#"))


def write_scene(path: Path, scene: Scene, count: int) -> None:
    """Write a scene down, with the how manyeth of its check it is."""
    from kinetile.scene.files import dumps_scene

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


def _limit_memory(more: int) -> None:
    """Let this process have so many bytes more than it has now, where the system can do that."""
    with contextlib.suppress(ImportError, OSError, ValueError):
        import resource

        pages = int(Path("/proc/self/statm").read_text().split()[0])
        limit = pages * resource.getpagesize() + more
        _, most = resource.getrlimit(resource.RLIMIT_AS)
        if most != resource.RLIM_INFINITY:
            limit = min(limit, most)
        resource.setrlimit(resource.RLIMIT_AS, (limit, most))


def main() -> None:
    """Carry out the order that stands on the first line of the standard input; tell on the standard
    output."""
    from kinetile.conformance.isolation.processes import as_a_child

    news = os.dup(1)
    os.dup2(2, 1)
    line = b""
    while not line.endswith(b"\n"):
        line += os.read(0, 1 << 16) or b"\n"
    order = Order(**json.loads(line))
    as_a_child(lambda tell: work(order, tell), news, 0)
