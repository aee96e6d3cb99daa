"""A study: a table of scenes, phases and seeds that is run task by task, stopped, continued and read."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import Any

from kinetile.errors import BadOption, UnknownName, nearest, one_of
from kinetile_bench import figures, results
from kinetile_bench.plan import StudyPlan, read_plan, read_plan_file
from kinetile_bench.pool import DaskPool, GivenExecutor, LocalPool, Pool, memory_for, processors
from kinetile_bench.rows import RowDisagreement, in_order
from kinetile_bench.store import Store
from kinetile_bench.study_run import CHANGED, StudyProgress, StudyRun, StudyStatus, status_of
from kinetile_bench.task import STATUSES, Task, tasks_of

_SHIPPED = Path(__file__).with_name("shipped")


class Study:
    """A study, from a file or from its tables.

    Args:
        source: a TOML file, the name of a study that ships (``shipped``), or a mapping as in such a file.
        results: the folder of the rows; None: what the study says, or its file's name with ``.results``.

    Raises:
        OSError: the file cannot be read.
        StudyError: it is no study; all mistakes are listed.
        UnknownName: no study that ships has this name.
    """

    def __init__(
        self,
        source: str | os.PathLike[str] | Mapping[str, Any],
        results: str | os.PathLike[str] | None = None,
    ) -> None:
        self.plan, beside = _read(source)
        folder = results if results is not None else self.plan.file.results
        if folder is None and beside is None:
            raise BadOption("a study that is given by its tables needs results: the name of a folder")
        if results is None and folder is not None and beside is not None:
            folder = beside.parent / folder
        self.results = Path(folder) if folder is not None else Path(f"{beside}.results")
        self._tasks: dict[str, Task] | None = None

    @property
    def tasks(self) -> Mapping[str, Task]:
        """All tasks by their keys, in the order of the file."""
        if self._tasks is None:
            self._tasks = {task.key: task for task in tasks_of(self.plan)}
        return self._tasks

    def run(
        self,
        executor: Executor | None = None,
        *,
        workers: int | None = None,
        dask: str | None = None,
        memory: int | None = None,
        quiet_core: bool = False,
        again: Sequence[str] = (),
        progress: Callable[[StudyProgress], None] | None = None,
        disagreed: Callable[[RowDisagreement], None] | None = None,
    ) -> StudyStatus:
        """Runs all tasks that have no row yet; returns how the study stands then.

        Args:
            executor: what runs them; None: processes of this machine.
            workers: how many processes, or how many tasks the executor runs at one time; None: as many as
                there are processors.
            dask: the address of a Dask scheduler, or "local".
            memory: the bytes that each process may take; None: an equal share of what the machine has.
            quiet_core: run one task at a time, so that no other task of the study disturbs the measurement.
            again: statuses ("failed", "lost", ...) whose rows are forgotten and whose tasks run again, or
                "changed": the rows of a scene file that has changed since.
            progress: called as rows arrive, and now and then; what it raises ends the run, and all rows that
                have come are on disk.
            disagreed: called at once with two rows that should have one list of contacts and have two.

        Raises:
            VersionsDiffer: a worker has other versions.
            StudyError: a scene file has changed since rows were made of it.
            RecordError: rows cannot be written.
            PoolError: the workers cannot go on; a later run can.
            BadOption: two kinds of workers are named, or a status that does not exist.
        """
        for status in again:
            if status not in (*STATUSES, CHANGED):
                raise BadOption(f"again is {status!r}; expected {one_of(status, (*STATUSES, CHANGED))}")
        pool = _pool(executor, workers, dask, memory, quiet_core, self.plan.file.limit)
        return StudyRun(Store(self.results), self.tasks, pool, progress, disagreed).run(again)

    def status(self) -> StudyStatus:
        """Returns how the study stands."""
        return status_of(Store(self.results), self.tasks)

    def rows(self, *, timings: bool = True) -> Any:
        """Returns the rows of all tasks that have one, as an Arrow table in the order of the tasks.

        A row's status is "disagrees" where another one of the same scene has other contacts. ``timings``
        False leaves out what differs from run to run.
        """
        return in_order(Store(self.results).read(), self.tasks, timings=timings)

    def table(self, y: str | None = None, x: str | None = None) -> dict[str, Any]:
        """Returns means over seeds, ratios, exponents and crossovers of the rows, in plain types.

        ``y`` is the column (None: CPU seconds for a unit of time), ``x`` the parameter over which exponents
        are fitted. Raises BadOption for a column without numbers.
        """
        return {"results": str(self.results)} | results.table(self.plan, self.rows(), y, x)

    def plot(self, folder: str | os.PathLike[str] | None = None) -> list[Path]:
        """Draws the figures of the study as SVG and PNG; returns their paths.

        Into ``folder``, or the results' own ``figures``. Raises MissingExtra without matplotlib, and
        BadOption for what cannot be drawn of these rows.
        """
        rows = self.rows()
        if not rows.num_rows:
            raise BadOption(f"{self.results} has no rows of this study yet: run it first")
        target = self.results / "figures" if folder is None else Path(folder)
        return figures.draw(self.plan, rows, target)


def shipped() -> list[str]:
    """Returns the names of the studies that ship with kinetile."""
    return sorted(path.stem for path in _SHIPPED.glob("*.toml"))


def shipped_tables(name: str) -> dict[str, Any]:
    """Returns the tables of a study that ships, for a variant of it."""
    return tomllib.loads((_SHIPPED / f"{name}.toml").read_text(encoding="utf-8"))


def _read(source: str | os.PathLike[str] | Mapping[str, Any]) -> tuple[StudyPlan, Path | None]:
    """Returns the plan of a study, and what its results are named after."""
    if isinstance(source, Mapping):
        return read_plan(source), None
    path = Path(source)
    if "\0" in str(path):
        raise BadOption(
            f"{str(path)!r} has a NUL in it: expected the name of a file or of a study that ships"
        )
    if isinstance(source, str) and not path.suffix and path.name == source and not path.exists():
        names = shipped()
        if source not in names:
            raise UnknownName("study that ships", source, suggestion=nearest(source, names), available=names)
        return read_plan_file(_SHIPPED / f"{source}.toml"), path
    return read_plan_file(path), path.with_suffix("")


def _pool(
    executor: Executor | None,
    workers: int | None,
    dask: str | None,
    memory: int | None,
    quiet_core: bool,
    limit: float | None,
) -> Pool:
    """Returns the workers that are named. Raises BadOption where two kinds are."""
    if workers is not None and workers < 1:
        raise BadOption(f"workers is {workers}; expected a number, at least 1")
    if executor is not None and dask is not None:
        raise BadOption("an executor and a Dask cluster: expected one of the two")
    if quiet_core and (dask is not None or executor is not None or workers not in (None, 1)):
        raise BadOption("a quiet core is one process of this machine: expected no workers, executor or Dask")
    if executor is not None:
        return GivenExecutor(executor, workers or processors())
    if dask is not None:
        return DaskPool(dask, workers, memory)
    width = 1 if quiet_core else workers or processors()
    return LocalPool(width, memory if memory is not None else memory_for(width), limit)
