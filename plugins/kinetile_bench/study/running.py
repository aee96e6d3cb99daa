"""A study runs: what has a row is left alone, what another process is at as well, and all else is done."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from kinetile.errors import Mistake, StudyError
from kinetile_bench.study.engines.driving import drive
from kinetile_bench.study.store.agreement import DISAGREES, Agreement
from kinetile_bench.study.store.columns import row_of
from kinetile_bench.study.study import Outcome, Progress
from kinetile_bench.study.work.doing import DONE, FAILED, LOST, OUT_OF_MEMORY, OUT_OF_TIME, REFUSED

if TYPE_CHECKING:
    from kinetile_bench.study.engines.engine import Engine
    from kinetile_bench.study.file import Task
    from kinetile_bench.study.store.agreement import Disagreement
    from kinetile_bench.study.store.rows import Store

__all__ = ["CHANGED", "STATUSES", "Running", "standing"]

CHANGED = "changed"
"""Rows of a scene file that has another content now."""

STATUSES = (DONE, REFUSED, FAILED, OUT_OF_MEMORY, OUT_OF_TIME, LOST, DISAGREES)
"""What may become of a task."""


def standing(store: Store, tasks: Mapping[str, Task], ran: int = 0, elsewhere: int = 0) -> Outcome:
    """Return how a study stands, by its rows."""
    table = store.read(Agreement.columns)
    rows = [] if table is None else table.to_pylist()
    mine = [row for row in rows if row["key"] in tasks]
    agreement = Agreement()
    disagreements = [str(said) for row in mine if (said := agreement.see(row)) is not None]
    odd = agreement.verdicts(mine)
    statuses = Counter(DISAGREES if row["key"] in odd else row["status"] for row in mine)
    return Outcome(
        len(tasks),
        dict(statuses),
        len(tasks) - len(mine),
        ran,
        elsewhere,
        len(rows) - len(mine),
        tuple(disagreements),
        tuple(map(str, _changed(rows, tasks))),
        store.damaged(),
    )


class Running:
    """One run of a study."""

    def __init__(
        self,
        store: Store,
        tasks: Mapping[str, Task],
        engine: Engine,
        progress: Callable[[Progress], None] | None,
        disagreed: Callable[[Disagreement], None] | None,
    ) -> None:
        self._store = store
        self._tasks = tasks
        self._engine = engine
        self._progress = progress
        self._disagreed = disagreed
        self._agreement = Agreement()
        self._there: set[str] = set()
        self._failed = 0
        self._ran = 0
        self._elsewhere = 0
        self._doing = ""

    def run(self, again: Sequence[str]) -> Outcome:
        """Do all tasks that have no row; return how the study stands."""
        well = False
        try:
            self._store.open()
            self._look(again)
            todo = [task for key, task in self._tasks.items() if key not in self._there]
            if todo:
                self._engine.check(
                    {tuple(sorted(each.versions.items())): each.versions for each in todo}.values()
                )
                self._doing = "compiling"
                self._tell()
                drive(
                    self._engine,
                    self._claimed(todo),
                    self._take,
                    compile_first=_first_of_each(todo),
                    tick=self._tell,
                )
            well = True
        finally:
            self._engine.end(at_once=not well)
            self._store.close()
        return standing(self._store, self._tasks, self._ran, self._elsewhere)

    def _look(self, again: Sequence[str]) -> None:
        """Learn which rows are there, and forget those that are to be done again."""
        table = self._store.read(Agreement.columns)
        found = [] if table is None else table.to_pylist()
        changed = _changed(found, self._tasks)
        if changed and CHANGED not in again:
            raise StudyError([each.mistake for each in changed])
        rows = [row for row in found if row["key"] in self._tasks]
        gone = {key for each in changed for key in each.keys}
        gone |= {row["key"] for row in rows if row["status"] in again}
        if DISAGREES in again:
            all_of_them = Agreement()
            for row in rows:
                all_of_them.see(row)
            gone |= all_of_them.verdicts(rows).keys()
        if gone:
            self._store.forget(gone)
        for row in rows:
            if row["key"] not in gone:
                self._agreement.see(row)
                self._there.add(row["key"])
                self._failed += row["status"] not in (DONE, REFUSED)

    def _claimed(self, todo: Sequence[Task]) -> Iterator[Task]:
        """Yield the tasks that nobody else has done or is at."""
        self._doing = ""
        for task in todo:
            if not self._store.claims.take(task.key):
                self._elsewhere += 1
            elif self._store.has(task.key):  # done by another process meanwhile
                self._store.claims.give_back(task.key)
                self._there.add(task.key)
            else:
                yield task

    def _take(self, task: Task, found: Mapping[str, Any], beside: int) -> None:
        """Write a row, and see whether it agrees with those that are there."""
        row = row_of(task, found, beside)
        self._store.put(row)
        self._store.claims.give_back(task.key)
        self._ran += 1
        self._there.add(task.key)
        self._failed += row["status"] not in (DONE, REFUSED)
        said = self._agreement.see(row)
        if said is not None and self._disagreed is not None:
            self._disagreed(said)

    def _tell(self) -> None:
        if self._progress is not None:
            self._progress(Progress(len(self._there), len(self._tasks), self._failed, self._doing))


class _Changed(NamedTuple):
    """A scene file of which there are rows (``keys``) of another content."""

    file: str
    keys: tuple[str, ...]

    def __str__(self) -> str:
        return f"{self.file} has changed: {len(self.keys):,} rows are of another content of it"

    @property
    def mistake(self) -> Mistake:
        expected = "the file as it was, another folder for the results, or --again changed to do them again"
        return Mistake("scenes", str(self), expected)


def _changed(rows: Sequence[Mapping[str, Any]], tasks: Mapping[str, Task]) -> list[_Changed]:
    """Return the scene files that have changed since rows were made of them."""
    now: dict[str, set[str]] = {}
    for task in tasks.values():
        if task.scene_sha256 is not None:
            now.setdefault(task.recipe, set()).add(task.scene_sha256)
    keys: dict[str, list[str]] = {}
    for row in rows:
        then = row.get("scene_sha256")
        if then is not None and row["recipe"] in now and then not in now[row["recipe"]]:
            keys.setdefault(row["recipe"], []).append(row["key"])
    return [_Changed(file, tuple(of)) for file, of in keys.items()]


def _first_of_each(tasks: Sequence[Task]) -> list[Task]:
    """Return, for each loop that may have to be compiled, the task with the fewest bodies.

    A loop depends on the phase and its options, and on what a recipe makes; numbers seldom change that.
    """
    found: dict[Any, Task] = {}
    for task in tasks:
        words = [value for value in task.parameters.values() if isinstance(value, str | bool)]
        kind = (task.phase, task.recipe, *words)
        if kind not in found or _size(task) < _size(found[kind]):
            found[kind] = task
    return list(found.values())


def _size(task: Task) -> float:
    bodies = task.parameters.get("bodies", 0)
    return bodies if isinstance(bodies, int | float) else 0
