"""One run of a study: the tasks that have no row yet, and that no other process has claimed, go to a pool.

If a process of a pool is killed, the pool breaks, and the responsible task is unknown. So in a new pool each
of the active tasks runs alone. The one that kills its worker again gets a
row with that status, and the rest get theirs. A worker that dies costs no row but that of its task.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Executor, Future, wait
from time import monotonic
from typing import Any, NamedTuple

from kinetile.errors import KinetileError, Mistake, StudyError
from kinetile_bench.pool import Pool, PoolError
from kinetile_bench.rows import Fingerprints, RowDisagreement, row_of
from kinetile_bench.runner import compile_task, run_task
from kinetile_bench.store import Store
from kinetile_bench.task import DISAGREES, DONE, LOST, OUT_OF_TIME, REFUSED, Task

CHANGED = "changed"
"""Rows of a scene file that has another content now; in ``again`` beside the statuses."""


class StudyProgress(NamedTuple):
    """Progress of a study: rows on disk, total tasks, failed tasks, present tasks."""

    done: int
    total: int
    failed: int
    doing: str = ""


class StudyStatus(NamedTuple):
    """How a study stands.

    Attributes:
        total: how many tasks it has.
        statuses: how many rows there are of each status.
        open: how many tasks have no row yet.
        ran: how many rows came in this run.
        elsewhere: how many tasks another process had claimed, in this run.
        others: rows in the folder that are of no task: of other versions, or of what the file had before.
        disagreements: in a sentence each, rows that should have one list of contacts and have two.
        changed: in a sentence each, scene files that rows were made of and that have changed since.
        damaged: how many files of rows have been moved away because their content was not what was written.
    """

    total: int
    statuses: Mapping[str, int]
    open: int
    ran: int
    elsewhere: int
    others: int
    disagreements: tuple[str, ...]
    changed: tuple[str, ...] = ()
    damaged: int = 0

    @property
    def well(self) -> bool:
        """Whether no row failed, was lost, or disagrees with another."""
        return not self.disagreements and not set(self.statuses) - {DONE, REFUSED}


def status_of(store: Store, tasks: Mapping[str, Task], ran: int = 0, elsewhere: int = 0) -> StudyStatus:
    """Returns how a study stands, by its rows on disk."""
    rows = _rows_in(store)
    mine = [row for row in rows if row["key"] in tasks]
    fingerprints = Fingerprints()
    disagreements = [str(found) for row in mine if (found := fingerprints.add(row)) is not None]
    odd = fingerprints.disagreeing(mine)
    statuses = Counter(DISAGREES if row["key"] in odd else row["status"] for row in mine)
    return StudyStatus(
        total=len(tasks),
        statuses=dict(statuses),
        open=len(tasks) - len(mine),
        ran=ran,
        elsewhere=elsewhere,
        others=len(rows) - len(mine),
        disagreements=tuple(disagreements),
        changed=tuple(map(str, _changed_files(rows, tasks))),
        damaged=store.damaged(),
    )


class StudyRun:
    """One run of a study: reads which rows there are, runs the other tasks, and writes their rows."""

    def __init__(
        self,
        store: Store,
        tasks: Mapping[str, Task],
        pool: Pool,
        progress: Callable[[StudyProgress], None] | None,
        disagreed: Callable[[RowDisagreement], None] | None,
    ) -> None:
        self._store = store
        self._tasks = tasks
        self._pool = pool
        self._progress = progress
        self._disagreed = disagreed
        self._fingerprints = Fingerprints()
        self._there: set[str] = set()
        self._failed = 0
        self._ran = 0
        self._elsewhere = 0
        self._doing = ""

    def run(self, again: Sequence[str]) -> StudyStatus:
        """Runs all tasks that have no row; returns how the study stands."""
        well = False
        try:
            self._store.open()
            self._read_rows(again)
            todo = [task for key, task in self._tasks.items() if key not in self._there]
            if todo:
                versions = {tuple(sorted(each.versions.items())): each.versions for each in todo}
                self._pool.check(versions.values())
                self._doing = "compiling"
                self._report()
                dispatcher = _Dispatcher(self._pool, self._claimed(todo), self._take, self._report)
                dispatcher.run(_first_of_each(todo))
            well = True
        finally:
            self._pool.end(at_once=not well)
            self._store.close()
        return status_of(self._store, self._tasks, self._ran, self._elsewhere)

    def _read_rows(self, again: Sequence[str]) -> None:
        """Reads which tasks have rows, and forgets those rows whose tasks are to run again."""
        found = _rows_in(self._store)
        changed = _changed_files(found, self._tasks)
        if changed and CHANGED not in again:
            raise StudyError([each.mistake for each in changed])
        rows = [row for row in found if row["key"] in self._tasks]
        gone = {key for each in changed for key in each.keys}
        gone |= {row["key"] for row in rows if row["status"] in again}
        if DISAGREES in again:  # which is no status on disk: it comes of all rows together
            gone |= Fingerprints(rows).disagreeing(rows).keys()
        if gone:
            self._store.forget(gone)
        for row in rows:
            if row["key"] not in gone:
                self._fingerprints.add(row)
                self._count(row)

    def _claimed(self, todo: Sequence[Task]) -> Iterator[Task]:
        """Yields the tasks that no other process has run or claimed, and claims them."""
        self._doing = ""
        for task in todo:
            if not self._store.claims.take(task.key):
                self._elsewhere += 1
            elif self._store.has(task.key):  # another process has run it since the rows were read
                self._store.claims.give_back(task.key)
                self._there.add(task.key)
            else:
                yield task

    def _take(self, task: Task, result: Mapping[str, Any], beside: int) -> None:
        """Writes the row of a task, and compares its contacts with those of the rows that are there."""
        row = row_of(task, result, beside)
        self._store.put(row)
        self._store.claims.give_back(task.key)  # after the row is there: the task is not run again
        self._ran += 1
        self._count(row)
        disagreement = self._fingerprints.add(row)
        if disagreement is not None and self._disagreed is not None:
            self._disagreed(disagreement)

    def _count(self, row: Mapping[str, Any]) -> None:
        self._there.add(row["key"])
        self._failed += row["status"] not in (DONE, REFUSED)

    def _report(self) -> None:
        if self._progress is not None:
            self._progress(StudyProgress(len(self._there), len(self._tasks), self._failed, self._doing))


class _Dispatcher:
    """Hands tasks to a pool, as many at a time as it runs, and passes on what comes of them.

    Args:
        pool: the workers.
        tasks: are taken from here one by one, when there is a worker for the next.
        take: called with a task, its result, and how many tasks ran beside it.
        tick: called now and then; what it raises ends all.
    """

    def __init__(
        self,
        pool: Pool,
        tasks: Iterator[Task],
        take: Callable[[Task, Mapping[str, Any], int], None],
        tick: Callable[[], None],
    ) -> None:
        self._pool = pool
        self._tasks = tasks
        self._take = take
        self._tick = tick
        self._under_way: dict[Future[Any], Task] = {}
        self._window = pool.width + (pool.width > 1)  # one task waits, so that no worker does

    def run(self, compile_first: Sequence[Task]) -> None:
        """Runs all tasks. The loops of ``compile_first`` are compiled before, each once, where otherwise
        several workers would compile the same one.

        Raises VersionsDiffer where a worker has other versions, and PoolError where the pool cannot go on.
        """
        executor = self._compiled(compile_first)
        while True:
            while len(self._under_way) < self._window and (task := next(self._tasks, None)) is not None:
                self._submit(executor, task)
            if not self._under_way:
                return
            beside = self._pool.beside(len(self._under_way))
            broken = [task for each in self._done() if (task := self._settled(each, beside)) is not None]
            if broken:
                executor = self._one_by_one(broken)

    def _compiled(self, tasks: Sequence[Task]) -> Executor:
        """Returns an executor after the loops of these tasks have been compiled into the cache."""
        executor = self._pool.start()
        try:
            under_way = {executor.submit(compile_task, task._asdict()) for task in tasks}
            while under_way:
                done, under_way = wait(under_way, timeout=0.5, return_when=FIRST_COMPLETED)
                self._tick()
                for future in done:
                    self._result(future)
        except BrokenExecutor:  # the task itself will show that in its row
            return self._pool.start()
        return executor

    def _submit(self, executor: Executor, task: Task) -> None:
        try:
            future = executor.submit(run_task, task._asdict())
        except BrokenExecutor:
            future = Future()
            future.set_exception(BrokenExecutor("the workers are gone"))
        self._under_way[future] = task

    def _done(self) -> set[Future[Any]]:
        """Waits for a while; returns the futures that are done by then."""
        done, _ = wait(self._under_way, timeout=0.5, return_when=FIRST_COMPLETED)
        self._tick()
        return done

    def _settled(self, future: Future[Any], beside: int) -> Task | None:
        """Passes on the result of a task; returns the task where its worker died."""
        task = self._under_way.pop(future)
        try:
            result = self._result(future)
        except (BrokenExecutor, CancelledError):
            return task
        self._take(task, result, beside)
        return None

    def _result(self, future: Future[Any]) -> Any:
        """Returns the result of a future. Raises PoolError for what no task can have raised."""
        try:
            return future.result()
        except (KinetileError, BrokenExecutor, CancelledError):
            raise
        except Exception as error:
            if type(error).__name__ == "KilledWorker":  # by name: Dask need not be there
                return {"status": LOST, "error": f"the workers died of it, one after the other: {error}"}
            raise PoolError(f"a task cannot be done here: {type(error).__name__}: {error}") from error

    def _one_by_one(self, broken: list[Task]) -> Executor:
        """Runs the tasks of a broken executor again, each alone: the one that breaks another executor gets a
        row that says so. Returns the executor to go on with."""
        for future in list(self._under_way):
            task = self._settled(future, 0) if future.done() else self._under_way.pop(future)
            broken += [task] if task is not None else []
        executor = self._pool.start()
        for task in broken:
            self._submit(executor, task)
            began = monotonic()
            while not (done := self._done()):
                pass
            if self._settled(done.pop(), 0) is not None:
                self._take(task, self._death(monotonic() - began), 0)
                executor = self._pool.start()
        return executor

    def _death(self, seconds: float) -> dict[str, Any]:
        """Returns the result of a task whose worker died a second time, with nothing else running."""
        limit = self._pool.limit
        if limit is not None and seconds >= limit:
            reason = f"it took more than {limit:g} CPU seconds, the study's limit, and its worker was ended"
            return {"status": OUT_OF_TIME, "error": reason}
        return {"status": LOST, "error": "its worker died, twice: the second time nothing else was running"}


class _ChangedFile(NamedTuple):
    """A scene file of which there are rows (``keys``) of another content."""

    file: str
    keys: tuple[str, ...]

    def __str__(self) -> str:
        return f"{self.file} has changed: {len(self.keys):,} rows are of another content of it"

    @property
    def mistake(self) -> Mistake:
        expected = "the file as it was, another folder for the results, or --again changed to do them again"
        return Mistake("scenes", str(self), expected)


def _rows_in(store: Store) -> list[dict[str, Any]]:
    """Returns all rows on disk, with the columns that ``Fingerprints`` needs."""
    table = store.read(Fingerprints.columns)
    return [] if table is None else list(table.to_pylist())


def _changed_files(rows: Sequence[Mapping[str, Any]], tasks: Mapping[str, Task]) -> list[_ChangedFile]:
    """Returns the scene files that have changed since rows were made of them."""
    now: dict[str, set[str]] = {}
    for task in tasks.values():
        if task.scene_sha256 is not None:
            now.setdefault(task.recipe, set()).add(task.scene_sha256)
    keys: dict[str, list[str]] = {}
    for row in rows:
        then = row.get("scene_sha256")
        if then is not None and row["recipe"] in now and then not in now[row["recipe"]]:
            keys.setdefault(row["recipe"], []).append(row["key"])
    return [_ChangedFile(file, tuple(of)) for file, of in keys.items()]


def _first_of_each(tasks: Sequence[Task]) -> list[Task]:
    """Returns, for each loop that may have to be compiled, the task with the fewest bodies.

    A loop depends on the phase and its options, and on what a recipe makes; numbers seldom change that.
    """
    found: dict[Any, Task] = {}
    for task in tasks:
        words = [value for value in task.parameters.values() if isinstance(value, str | bool)]
        kind = (task.phase, task.recipe, *words)
        if kind not in found or _bodies(task) < _bodies(found[kind]):
            found[kind] = task
    return list(found.values())


def _bodies(task: Task) -> float:
    bodies = task.parameters.get("bodies", 0)
    return bodies if isinstance(bodies, int | float) else 0
