"""Engines in any language: a program that reads scenes and writes contacts is judged over a pipe.

One line of JSON goes each way for a scene, and the next scene is sent when the last one is answered: so a
full pipe stops neither side. The scenes are those of the kit's checks that compare contacts, and a scene on
which the lists differ is minimised as there. An engine that does not keep to the protocol is not judged:
``EngineError`` says what it did, and on which scene.
"""

from __future__ import annotations

import json
import math
import os
import queue
import shlex
import signal
import subprocess
import threading
import time
import tomllib
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Self, cast

import numpy as np
from numpy.typing import NDArray

from kinetile.errors import KinetileError
from kinetile.kernel.log import WALLS
from kinetile.scene import Insert, Scene
from kinetile.scene.files import dumps_scene
from kinetile_accuracy.specification.certify import explain_difference
from kinetile_conformance.cases import CONTACTS, LATTICE_CONTACTS, REFERENCE, Subject, horizon, outcome
from kinetile_conformance.checks import CHECKS
from kinetile_conformance.checks.check import JUDGED, Check
from kinetile_conformance.deadline import spent
from kinetile_conformance.drawing import Drawing, reduced
from kinetile_conformance.reporting import Report, Result
from kinetile_conformance.runner import EXAMPLES, REDUCING
from kinetile_conformance.strategies.changes import ended_at

SECONDS = 10.0
"""Seconds by the clock that an engine has for a scene."""

LONGEST = 2**26
"""Bytes of the longest answer."""

CHUNK, CHUNKS = 2**16, 64
"""Bytes that are read at once, and how many such pieces wait to be looked at: an engine that floods waits."""

FULL_TICK = 2**52
"""Ticks of an epoch."""

SHORTENINGS = 20
"""How often a scene with too many contacts is made to end sooner, before it is passed over."""

JUDGING = {
    "same-contacts": "It gives the reference's contacts of small scenes.",
    "same-contacts-with-turns": "The same while bodies turn at scheduled times.",
    "same-contacts-on-lattices": "The same on a hundred small lattices at once, where exact ties abound.",
    "same-contacts-in-a-scaled-swarm": "The same of swarms at any scale, and far from the origin.",
    "same-contacts-on-a-torus": "The same where axes are periodic.",
    "same-contacts-of-shapes": "The same of boxes, capsules and polygons.",
    "same-contacts-of-shapes-on-a-torus": "The same of those where axes are periodic.",
    "same-contacts-as-bodies-come-and-go": "The same while bodies come and go.",
    "same-contacts-when-commanded-by-hand": "The same where commands come after contacts of their tick.",
    "same-contacts-with-responses": "The same where bodies have kinds, and other responses than elastic.",
    "same-contacts-while-some-pass": "The same where some pass through each other.",
}
"""The checks that an engine is put to, with what each says of it."""

EXACT, TIMED = ["epoch", "tick", "a", "b"], ["time", "a", "b"]
"""The fields of a contact in an answer; the second where times are compared within a distance."""

Row = tuple[float, ...]
"""A contact of an answer, its fields in this order."""


class EngineError(KinetileError, RuntimeError):
    """An engine does not start, ends early, gives no answer in time, or one that is none."""


class Engine:
    """A program that answers scenes, one line for one line; its stderr is passed on.

    Args:
        command: the program and its arguments, as a shell splits them; no shell runs it.
        seconds: the limit for a scene, by the clock.
        timed: whether contacts have times in place of ticks.
    """

    def __init__(self, command: str, seconds: float = SECONDS, timed: bool = False) -> None:
        self.command = command
        self._seconds = seconds
        self._timed = timed
        self.start()

    def start(self) -> None:
        """Start the program. It has a process group of its own, so that what it starts ends with it."""
        try:
            words = shlex.split(self.command)
            if not words:
                raise ValueError("it names no program")
            self._child = subprocess.Popen(
                words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, bufsize=0, process_group=0
            )
        except (OSError, ValueError) as error:
            why = error.strerror if isinstance(error, OSError) else error
            raise EngineError(f"--command {self.command!r} does not start: {why}") from error
        self._rest = b""
        self._chunks: queue.Queue[bytes] = queue.Queue(CHUNKS)
        threading.Thread(target=_read, args=(self._child.stdout, self._chunks), daemon=True).start()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.end()

    def end(self) -> None:
        """End the program and what it has started."""
        self._kill()
        self._child.wait()
        for pipe in (self._child.stdin, self._child.stdout):
            with suppress(OSError):  # a line that was not sent cannot be sent any more
                if pipe is not None:
                    pipe.close()

    def _kill(self) -> None:
        if hasattr(os, "killpg"):
            with suppress(ProcessLookupError):
                os.killpg(self._child.pid, signal.SIGKILL)
        self._child.kill()

    def cpu_seconds(self) -> float:
        """Return the CPU seconds of the program, without what it has started; 0 where the system does not
        tell."""
        with suppress(OSError, OverflowError, AttributeError):
            return time.clock_gettime(~self._child.pid << 3 | 2)  # Linux: the clock of another process
        return 0.0

    def peak_bytes(self) -> int | None:
        """Return the most memory that the program has had; None where the system does not tell."""
        with suppress(OSError, ValueError, StopIteration):
            lines = Path(f"/proc/{self._child.pid}/status").read_text(encoding="utf-8").splitlines()
            return 1024 * int(next(line for line in lines if line.startswith("VmHWM:")).split()[1])
        return None

    def answer(self, scene: Scene) -> list[Row] | str:
        """Return the engine's contacts of a scene, or why it refuses it; raise EngineError for any other
        answer, and for none."""
        line = self._exchanged(scene_line(scene))
        shown = f"the engine answered {line[:80]!r}"
        try:
            found = json.loads(line)
        except (ValueError, RecursionError) as error:
            raise EngineError(f"{shown}, which is no JSON: {error}") from error
        match found:
            case {"refused": str(reason), **rest} if not rest:
                return reason
            case {"contacts": list(rows), **rest} if not rest:
                for at, row in enumerate(rows):
                    wrong = _fault_of(row, scene, self._timed)
                    if wrong:
                        raise EngineError(f"the engine's contact {at} is {json.dumps(row)[:80]}: {wrong}")
                return [tuple(row) for row in rows]
        raise EngineError(f'{shown}; expected {{"contacts": [...]}} or {{"refused": "reason"}}')

    def _exchanged(self, line: bytes) -> str:
        """Send a line and return the one that comes back.

        Neither side of a pipe has a limit of its own, and ending the program need not close it: what it has
        started in another session may hold it. So threads read and write, and this one waits for so long.
        """
        end = time.monotonic() + self._seconds
        threading.Thread(target=_write, args=(self._child.stdin, line), daemon=True).start()
        answer = bytearray(self._rest)
        seen = 0  # of it, without the end of a line
        while (at := answer.find(b"\n", seen)) < 0 and len(answer) < LONGEST:
            seen = len(answer)
            try:
                chunk = self._chunks.get(timeout=max(end - time.monotonic(), 0.0))
            except queue.Empty:
                self._kill()
                late = f"the engine gave no answer within {self._seconds:g} s (--scene-seconds)"
                raise EngineError(late) from None
            if not chunk:
                break
            answer += chunk
        self._rest = bytes(answer[at + 1 :]) if at >= 0 else b""
        if at >= 0:
            return answer[: at + 1].decode("utf-8", errors="replace")
        if len(answer) >= LONGEST:
            raise EngineError(f"the engine's answer has no end after {LONGEST:,} bytes")
        how = "closed its output"
        with suppress(subprocess.TimeoutExpired):
            code = self._child.wait(1.0)
            how = f"ended with exit code {code}" if code >= 0 else f"ended by {signal.Signals(-code).name}"
        raise EngineError(f"the engine {how} {'within a line' if answer else 'without an answer'}")


def _read(pipe: Any, chunks: queue.Queue[bytes]) -> None:
    """Pass on what comes through a pipe, and b"" at its end."""
    chunk = b"more"
    while chunk:
        chunk = b""
        with suppress(OSError, ValueError):  # it has been closed meanwhile
            chunk = pipe.read(CHUNK)
        chunks.put(chunk)


def _write(pipe: Any, line: bytes) -> None:
    """Send a line through a pipe, as far as it goes."""
    rest = memoryview(line)
    with suppress(OSError, ValueError):
        while rest:
            rest = rest[pipe.write(rest) :]


def _fault_of(row: object, scene: Scene, timed: bool) -> str:
    """Return what is wrong with the form of a contact, or ""."""
    fields = TIMED if timed else EXACT
    form = f"[{', '.join(fields)}]"
    if not isinstance(row, list) or len(row) != len(fields):
        return f"expected {form}"
    *when, a, b = row
    if not all(type(each) is int for each in (row[1:] if timed else row)):
        return f"expected {form}, all {'but the time ' if timed else ''}whole numbers"
    if timed and not (type(when[0]) in (int, float) and math.isfinite(when[0])):
        return f"expected {form}, the time a finite number"
    if not timed and not (0 <= when[1] < FULL_TICK and -FULL_TICK < when[0] < FULL_TICK):
        return "expected a tick from 0 to 2^52 - 1, and its epoch"
    for body in (a, b):
        if body > _last_body(scene) or (body < 0 and (body is a or scene.arena is None or body not in WALLS)):
            return f"there is no {'body' if body >= 0 or body is a else 'wall'} {body}"
    return "a body does not meet itself" if a == b else ""


def _last_body(scene: Scene) -> int:
    """Return the highest number of the bodies that there are or will be."""
    return max([len(scene) - 1, *(each.body for each in scene.commands if isinstance(each, Insert))])


def scene_line(scene: Scene) -> bytes:
    """Return a scene as a line of JSON: the tables of its file, with an infinite mass as "inf"."""
    tables = tomllib.loads(dumps_scene(scene))
    for body in tables.get("bodies", ()):
        if body.get("mass") == math.inf:
            body["mass"] = "inf"
    return json.dumps(tables, allow_nan=False).encode() + b"\n"


def reference_contacts(scene: Scene, most: int) -> tuple[Scene, NDArray[np.void]] | None:
    """Return a scene with its contacts by the reference. A scene that has ``most`` and more, or that jams,
    is made to end sooner; None: it has too many at its start."""
    scene = ended_at(scene, horizon(scene))
    for _ in range(SHORTENINGS):
        run = outcome(Subject(REFERENCE, {}).reference, scene, most)
        if run.ended == "ran" and len(run.contacts) < most:
            return scene, run.contacts
        last = float(run.contacts["time"][-1]) if len(run.contacts) else horizon(scene)
        scene = ended_at(scene, scene.start + (last - scene.start) / 2.0)
    return None


def difference(
    scene: Scene, found: Sequence[Row], expected: NDArray[np.void], within: float | None
) -> str | None:
    """Return where an engine's contacts first differ from the reference's, in a sentence; None: nowhere.

    ``within`` is the distance of times from the start, relative to these (where they are less than the
    scene's unit of time, to that); None: ticks are the same. A contact so near to the end may be missing.
    """
    right: list[Row] = expected[EXACT if within is None else TIMED].tolist()

    def near(one: float, other: float) -> bool:
        size = max(abs(one - scene.start), abs(other - scene.start), scene.time_unit)
        return abs(one - other) <= cast(float, within) * size

    for at in range(max(len(found), len(right))):
        mine, theirs = (rows[at] if at < len(rows) else None for rows in (found, right))
        if mine == theirs:
            continue
        if within is not None:
            if mine and theirs and mine[1:] == theirs[1:] and near(mine[0], theirs[0]):
                continue
            one = mine or theirs
            if (mine is None or theirs is None) and one and near(one[0], horizon(scene)):
                continue
        if mine is None:
            said = f"contact {at} is missing: {_told(theirs)}"
        elif theirs is None:
            said = f"contact {at} is one too many: {_told(mine)}"
        else:
            said = f"contact {at} is {_told(mine)}, and should be {_told(theirs)}"
        return said + (_who_is_right(scene, found, expected, at) if within is None else "")
    return None


def _told(row: Row | None) -> str:
    """Return a contact in words."""
    *when, a, b = row or ()
    partner = f"the {WALLS[int(b)]} wall" if b < 0 else f"body {b}"
    moment = f"time {when[0]!r}" if len(when) == 1 else f"epoch {when[0]}, tick {when[1]}"
    return f"body {a} with {partner} at {moment}"


def _who_is_right(scene: Scene, found: Sequence[Row], expected: NDArray[np.void], at: int) -> str:
    """Return a line that says which contact is right by the specification, where that decides it quickly."""
    if len(scene) > JUDGED:
        return ""
    right = expected[EXACT]
    mine = np.array([tuple(row) for row in found], right.dtype)
    said = explain_difference(scene, {"the engine": mine, REFERENCE: right}, at)
    return f"\n{said}" if said else ""


@dataclass(frozen=True)
class EngineReport(Report):
    """All results of an engine; ``name`` is its command, ``within`` the relative distance of times allowed,
    None where ticks are compared."""

    within: float | None = None

    def as_dict(self) -> dict[str, Any]:
        """Return the report, fit for JSON."""
        of_phases = ("broad_phase", "options", "narrow_phases", "distribution", "tightness")
        kept = {key: value for key, value in super().as_dict().items() if key not in of_phases}
        return {"command": self.name, "within": self.within} | kept

    @property
    def refuses_all(self) -> bool:
        """Whether the engine has refused every scene that it was given: it cannot be judged then."""
        return bool(self.results) and all(result.status == "skipped" for result in self.results)

    @property
    def ok(self) -> bool:
        """Whether the engine conforms."""
        return super().ok and not self.refuses_all

    @property
    def not_judged(self) -> str:
        """Why it is not judged."""
        return "it refuses every scene" if self.refuses_all else super().not_judged

    @property
    def head(self) -> str:
        """The line above the results."""
        how = "exact ticks" if self.within is None else f"times within {self.within:g}"
        return f"conformance kit {self.kit}: command {self.name!r}, {how}"

    def replays(self, case: Path) -> str:
        """Return the command that shows a failure again."""
        return f"head -n 1 {case.with_suffix('.jsonl')} | {self.name}"


class _Judged:
    """An engine under one check: what it was shown, and the last scene on which it failed."""

    def __init__(self, engine: Engine, each: Check, within: float | None, shown: Callable[[], None]) -> None:
        self.engine = engine
        self.most = LATTICE_CONTACTS if each.name == "same-contacts-on-lattices" else CONTACTS
        self.within = within
        self.count = self.refused = 0
        self.refusal = self.said = ""
        self.scene: Scene | None = None
        self.found: Sequence[Row] = ()
        self.expected: NDArray[np.void] | None = None
        self._shown = shown

    def holds(self, scene: Scene) -> bool:
        """Return whether the engine has the reference's contacts of a scene, or refuses it."""
        self.count += 1
        self._shown()
        judged = reference_contacts(scene, self.most)
        if judged is None:
            return True
        scene, expected = judged
        try:
            found = self.engine.answer(scene)
        except EngineError as error:
            self.said, self.scene, self.expected = str(error), scene, None
            raise
        if isinstance(found, str):
            self.refused += 1
            self.refusal = found
            return True
        said = difference(scene, found, expected, self.within)
        if said is None:
            return True
        self.said, self.scene, self.found, self.expected = said, scene, found, expected
        return False

    def minimise(self) -> None:
        """Search for a smaller scene. Then a fresh process is given it alone: what an engine keeps from one
        scene to the next shows there."""
        end = time.monotonic() + 3.0 * REDUCING  # the CPU time of the engine is not this process's
        reduced(
            cast(Scene, self.scene), lambda fewer: time.monotonic() < end and not self.holds(fewer), REDUCING
        )
        said, scene = self.said, self.scene
        self.engine.end()
        self.engine.start()
        if self.holds(cast(Scene, scene)):
            said += "\n(not in a fresh process: the engine keeps something from one scene to the next)"
        self.said = said

    def saved(self, folder: Path, check: str) -> Path:
        """Save the scene as a file, and beside it the line that the engine was sent, with its answer and the
        reference's, where there are any; return the path."""
        scene = cast(Scene, self.scene)
        path = folder / f"engine-{check}.toml"
        folder.mkdir(parents=True, exist_ok=True)
        said = "".join(f"# said: {line}\n" for line in self.said.splitlines())
        head = f"# engine: {self.engine.command}\n{said}"
        path.write_text(head + dumps_scene(scene), encoding="utf-8")
        lines = [scene_line(scene).decode()]
        if self.expected is not None:
            right = self.expected[EXACT if self.within is None else TIMED].tolist()
            for rows in (self.found, right):
                lines.append(json.dumps({"contacts": rows}) + "\n")
        path.with_suffix(".jsonl").write_text("".join(lines), encoding="utf-8")
        return path


def check_engine(
    command: str,
    *,
    within: float | None = None,
    seconds: float = SECONDS,
    examples: int = EXAMPLES,
    checks: Sequence[str] | None = None,
    save_to: Path | None = None,
    shrink: bool = True,
    seed: int = 0,
    on_result: Callable[[Result], None] = lambda result: None,
    on_scene: Callable[[str, int], None] = lambda check, count: None,
) -> EngineReport:
    """Judge an engine over a pipe; return the report. ``checks`` are names of ``JUDGING``, None: all.

    Raises:
        EngineError: it does not start, or does not keep to the protocol.
    """
    began = time.perf_counter()
    drawing = Drawing(examples, seed)
    results: list[Result] = []
    with Engine(command, seconds, timed=within is not None) as engine:
        for each in CHECKS:
            if each.name in (JUDGING if checks is None else checks):
                results.append(_judge(engine, each, within, drawing, shrink, save_to, on_scene))
                on_result(results[-1])
    took = time.perf_counter() - began
    return EngineReport(command, {}, "", tuple(results), seconds=took, within=within)


def _judge(
    engine: Engine,
    each: Check,
    within: float | None,
    drawing: Drawing,
    shrink: bool,
    save_to: Path | None,
    on_scene: Callable[[str, int], None],
) -> Result:
    """Run one check."""
    began = spent()
    judged = _Judged(engine, each, within, lambda: on_scene(each.name, judged.count))
    try:
        if drawing.scenes_fail(each, judged.holds) and shrink:
            judged.minimise()
    except EngineError as error:
        where = f"; the scene is saved: {judged.saved(save_to, each.name)}" if save_to else ""
        raise EngineError(f"{error} ({each.name}, scene {judged.count}{where})") from error
    result = Result(each.name, JUDGING[each.name], "passed", judged.count, spent() - began)
    if judged.said:
        case = judged.saved(save_to, each.name) if save_to else None
        bodies = len(cast(Scene, judged.scene))
        return replace(result, status="failed", said=judged.said, bodies=bodies, case=case)
    if judged.refused:
        whole = judged.refused == judged.count
        reason = f"it refuses {judged.refused} of {judged.count} scenes, such as: {judged.refusal}"
        return replace(result, status="skipped" if whole else "passed", reason=reason)
    return result
