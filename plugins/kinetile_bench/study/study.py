"""A study: a table of scenes, phases and seeds, run task by task, stopped, gone on with, read."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from kinetile.errors import BadOption, UnknownName, nearest, one_of
from kinetile_bench.study.file import Plan, Task, read_plan, read_plan_file, tasks_of

if TYPE_CHECKING:
    from kinetile_bench.study.engines.engine import Engine
    from kinetile_bench.study.store import agreement
    from kinetile_bench.study.store.rows import Store

__all__ = ["Outcome", "Progress", "Study", "shipped", "shipped_tables"]

_SHIPPED = Path(__file__).with_name("shipped")


class Progress(NamedTuple):
    """How far a study is: rows that are there, of so many tasks; those that failed; what is being done."""

    done: int
    total: int
    failed: int
    doing: str = ""


class Outcome(NamedTuple):
    """How a study stands.

    Attributes:
        total: how many tasks it has.
        statuses: how many rows there are of each status.
        open: how many tasks have no row yet.
        ran: how many rows came in this run.
        elsewhere: how many tasks another process was at, in this run.
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
        return not self.disagreements and not set(self.statuses) - {"done", "refused"}


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
        folder = results if results is not None else self.plan.results
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

    # Running

    def run(
        self,
        executor: Executor | None = None,
        *,
        workers: int | None = None,
        dask: str | None = None,
        memory: int | None = None,
        quiet_core: bool = False,
        again: Sequence[str] = (),
        progress: Callable[[Progress], None] | None = None,
        disagreed: Callable[[agreement.Disagreement], None] | None = None,
    ) -> Outcome:
        """Do all tasks that have no row yet.

        Args:
            executor: what does them; None: processes of this machine.
            workers: how many processes, or how many tasks the executor does at one time; None: as many as
                there are processors.
            dask: the address of a Dask scheduler, or "local".
            memory: the bytes that each process may take; None: what the machine has, shared out.
            quiet_core: do one task at a time, so that nothing of the study runs beside what is measured.
            again: statuses ("failed", "lost", ...) whose rows are forgotten and done again, or
                "changed": the rows of a scene file that has changed since.
            progress: called as rows arrive, and now and then; what it raises ends the run, and all rows that
                have come are there.
            disagreed: told at once of two rows that should have one list of contacts and have two.

        Raises:
            VersionsDiffer: a worker has other versions.
            StudyError: a scene file has changed since rows were made of it.
            RecordError: rows cannot be written.
            EngineError: what does the tasks cannot go on; a later run can.
            BadOption: two engines are asked for, or a status that there is not.
        """
        from kinetile_bench.study.running import CHANGED, STATUSES, Running

        for status in again:
            if status not in (*STATUSES, CHANGED):
                raise BadOption(f"again is {status!r}; expected {one_of(status, (*STATUSES, CHANGED))}")
        engine = _engine(executor, workers, dask, memory, quiet_core, self.plan.limit)
        running = Running(self._store(), self.tasks, engine, progress, disagreed)
        return running.run(again)

    def status(self) -> Outcome:
        """Return how the study stands."""
        from kinetile_bench.study.running import standing

        return standing(self._store(), self.tasks)

    # Reading out

    def rows(self, *, timings: bool = True) -> Any:
        """Return the rows of all tasks that have one, as an Arrow table in the order of the tasks.

        A row's status is "disagrees" where another one of the same scene has other contacts. ``timings``
        False leaves out what differs from run to run.
        """
        from kinetile_bench.study.results.reading import rows_of

        return rows_of(self._store(), self.tasks, timings=timings)

    def table(self, y: str | None = None, x: str | None = None) -> dict[str, Any]:
        """Return what the rows come to: means over seeds, ratios, exponents, crossovers, in plain types.

        ``y`` is the column that is looked at (None: CPU seconds for a unit of time), ``x`` the parameter over
        which exponents are fitted.
        """
        from kinetile_bench.study.results.table import table

        return table(self, y, x)

    def plot(self, folder: str | os.PathLike[str] | None = None) -> list[Path]:
        """Draw the figures of the study as SVG and PNG; return their paths.

        Into ``folder``, or the results' own ``figures``. Raises MissingExtra without matplotlib.
        """
        from kinetile_bench.study.results.figures import draw

        return draw(self, Path(folder) if folder is not None else self.results / "figures")

    def _store(self) -> Store:
        from kinetile_bench.study.store.rows import Store

        return Store(self.results)


def shipped() -> list[str]:
    """Return the names of the studies that ship with kinetile."""
    return sorted(path.stem for path in _SHIPPED.glob("*.toml"))


def shipped_tables(name: str) -> dict[str, Any]:
    """Return the tables of a study that ships, for one that is like it."""
    return tomllib.loads((_SHIPPED / f"{name}.toml").read_text(encoding="utf-8"))


def _read(source: str | os.PathLike[str] | Mapping[str, Any]) -> tuple[Plan, Path | None]:
    """Return what a study asks for, and what its results are named after."""
    if isinstance(source, Mapping):
        return read_plan(source), None
    path = Path(source)
    if "\0" in str(path):
        raise BadOption(
            f"{str(path)!r} has a NUL in it: expected the name of a file or of a study that ships"
        )
    if isinstance(source, str) and not path.suffix and path.name == source and not path.exists():
        if source not in shipped():
            raise UnknownName(
                "study that ships", source, suggestion=nearest(source, shipped()), available=shipped()
            )
        return read_plan_file(_SHIPPED / f"{source}.toml"), path
    return read_plan_file(path), path.with_suffix("")


def _engine(
    executor: Executor | None,
    workers: int | None,
    dask: str | None,
    memory: int | None,
    quiet_core: bool,
    limit: float | None,
) -> Engine:
    """Return what does the tasks. Raises BadOption where two are asked for."""
    from kinetile_bench.study.engines.local import LocalProcesses, memory_for, processors

    if workers is not None and workers < 1:
        raise BadOption(f"workers is {workers}; expected a number, at least 1")
    if executor is not None and dask is not None:
        raise BadOption("an executor and a Dask cluster: expected one of the two")
    if quiet_core and (dask is not None or executor is not None or workers not in (None, 1)):
        raise BadOption("a quiet core is one process of this machine: expected no workers, executor or Dask")
    if executor is not None:
        from kinetile_bench.study.engines.engine import Brought

        return Brought(executor, workers or processors())
    if dask is not None:
        from kinetile_bench.study.engines.cluster import DaskCluster

        return DaskCluster(dask, workers, memory)
    width = 1 if quiet_core else workers or processors()
    return LocalProcesses(width, memory if memory is not None else memory_for(width), limit)
