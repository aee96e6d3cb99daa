"""Tasks are handed out, rows are taken in, and a worker that dies costs no row but that of its task.

Where a process of a pool is killed, the pool is broken, and nobody says which task it was. So all that were
under way are under suspicion: in a new pool each of them is done alone. What kills its worker there once
more has a row that says so, and the rest have theirs.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, CancelledError, Executor, Future, wait
from time import monotonic
from typing import Any

from kinetile.errors import KinetileError
from kinetile_bench.study.engines.engine import Engine, EngineError
from kinetile_bench.study.file.tasks import Task
from kinetile_bench.study.work.doing import LOST, OUT_OF_TIME, compile_for, do_task

__all__ = ["drive"]

Take = Callable[[Task, Mapping[str, Any], int], None]
"""Told of a task, of what came of it, and how many ran beside it."""


def drive(
    engine: Engine,
    tasks: Iterator[Task],
    take: Take,
    *,
    compile_first: Sequence[Task] = (),
    tick: Callable[[], None],
) -> None:
    """Have all tasks done, as an engine can do them.

    The loops of ``compile_first`` are compiled before, each once, where many workers would each do it.
    ``tick`` is called now and then; what it raises ends this. Raises VersionsDiffer where a worker has
    other versions, and EngineError where the engine cannot go on.
    """
    driver = _Driver(engine, tasks, take, tick)
    driver.run(driver.compiled(compile_first))


class _Driver:
    def __init__(self, engine: Engine, tasks: Iterator[Task], take: Take, tick: Callable[[], None]) -> None:
        self._engine = engine
        self._tasks = tasks
        self._take = take
        self._tick = tick
        self._suspects: deque[Task] = deque()
        self._under_way: dict[Future[Any], Task] = {}
        self._begun = 0.0  # when the last task was handed out
        self._window = engine.width + (engine.width > 1)

    def compiled(self, tasks: Sequence[Task]) -> Executor:
        """Return an executor, for which the loops of these tasks lie in the cache."""
        executor = self._engine.start()
        under_way = {executor.submit(compile_for, _order(task)) for task in tasks}
        try:
            while under_way:
                done, under_way = wait(under_way, timeout=0.5, return_when=FIRST_COMPLETED)
                self._tick()
                for future in done:
                    future.result()
        except BrokenExecutor:  # the task itself will tell
            return self._engine.start()
        return executor

    def run(self, executor: Executor) -> None:
        """Have all tasks done."""
        while self._hand_out(executor):
            done, _ = wait(self._under_way, timeout=0.5, return_when=FIRST_COMPLETED)
            self._tick()
            beside = self._engine.beside(len(self._under_way))
            broken = [task for future in done if (task := self._settled(future, beside)) is not None]
            if broken:
                executor = self._begin_anew(broken)

    def _hand_out(self, executor: Executor) -> bool:
        """Keep the workers busy; return whether anything is under way."""
        if self._suspects and not self._under_way:
            self._submit(executor, self._suspects[0])
        while not self._suspects and len(self._under_way) < self._window:
            task = next(self._tasks, None)
            if task is None:
                break
            self._submit(executor, task)
        return bool(self._under_way)

    def _submit(self, executor: Executor, task: Task) -> None:
        try:
            future = executor.submit(do_task, _order(task))
        except BrokenExecutor:
            future = Future()
            future.set_exception(BrokenExecutor("the workers are gone"))
        self._under_way[future] = task
        self._begun = monotonic()

    def _settled(self, future: Future[Any], beside: int) -> Task | None:
        """Take in what came of a task; return the task where its worker died."""
        task = self._under_way.pop(future)
        try:
            found = future.result()
        except (BrokenExecutor, CancelledError):
            return task
        except KinetileError:
            raise
        except Exception as error:
            if type(error).__name__ != "KilledWorker":  # by name: Dask need not be there
                raise EngineError(f"a task cannot be done here: {type(error).__name__}: {error}") from error
            found = {"status": LOST, "error": f"the workers died of it, one after the other: {error}"}
        if self._suspects and task is self._suspects[0]:
            self._suspects.popleft()
        self._take(task, found, beside)
        return None

    def _begin_anew(self, broken: list[Task]) -> Executor:
        """Put the tasks of a broken executor under suspicion, and return another one."""
        for future in list(self._under_way):
            task = self._settled(future, 0) if future.done() else self._under_way.pop(future)
            broken += [task] if task is not None else []
        if self._suspects and broken == [self._suspects[0]]:
            self._take(self._suspects.popleft(), self._death(), 0)
        else:
            self._suspects.extend(task for task in broken if task not in self._suspects)
        return self._engine.start()

    def _death(self) -> dict[str, Any]:
        """Return what came of a task whose worker died a second time, with nothing else running."""
        limit = self._engine.limit
        if limit is not None and monotonic() - self._begun >= limit:
            said = f"it took more than {limit:g} CPU seconds, the study's limit, and its worker was ended"
            return {"status": OUT_OF_TIME, "error": said}
        return {"status": LOST, "error": "its worker died, twice: the second time nothing else was running"}


def _order(task: Task) -> dict[str, Any]:
    """Return a task as a worker is given it."""
    return task._asdict()
