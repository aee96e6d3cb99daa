"""Studies: tables of scenes, phases and seeds, run task by task, stopped, continued and read."""

import os
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import closing
from pathlib import Path
from typing import Any, NamedTuple

from kinetile.errors import BadOption, one_of
from kinetile_bench.study.plan import read_plan, read_plan_file
from kinetile_bench.study.rows import Agreement, RowFile
from kinetile_bench.study.summary import summary_of
from kinetile_bench.study.task import DONE, REFUSED, STATUSES, Row, Task, row_of, tasks_of
from kinetile_bench.study.workers import rows_of


class StudyStatus(NamedTuple):
    """The progress of a study: the numbers of rows by status, of tasks without a row (``open``), of rows from
    this run (``ran``), and of rows in the file without a task (``others``: from other versions, or from a
    former study). ``disagreements`` are, in a sentence each, rows that should have one list of contacts and
    have two."""

    total: int
    statuses: Mapping[str, int]
    open: int
    ran: int
    others: int
    disagreements: tuple[str, ...]

    @property
    def well(self) -> bool:
        """True if no row failed, was lost, or disagrees with another."""
        return not set(self.statuses) - {DONE, REFUSED}


class Study:
    """A study, from a TOML file or from tables as in one; ``results`` is the SQLite file of the rows, by
    default the study's own, or its file's name with ``.sqlite``. Raises OSError if the file cannot be read,
    StudyError with all mistakes, and BadOption if neither its tables nor ``results`` name a file."""

    def __init__(
        self,
        source: str | os.PathLike[str] | Mapping[str, Any],
        results: str | os.PathLike[str] | None = None,
    ) -> None:
        if isinstance(source, Mapping):
            self.plan, usual = read_plan(source), None
        else:
            self.plan, usual = read_plan_file(source), Path(source).with_suffix(".sqlite")
        found = (self.plan.results or usual) if results is None else Path(results)
        if found is None:
            raise BadOption("a study that is given by its tables needs results: the name of a file")
        self.results = found
        self.tasks: Mapping[str, Task] = {task.key: task for task in tasks_of(self.plan)}
        """All tasks by their keys, in the order of the file."""

    def run(
        self,
        executor: Executor | None = None,
        *,
        workers: int | None = None,
        again: Sequence[str] = (),
        progress: Callable[[int, int], None] | None = None,
        disagreed: Callable[[str], None] | None = None,
    ) -> StudyStatus:
        """Runs all tasks that have no row yet; returns the progress then.

        Args:
            executor: any executor of ``concurrent.futures``, or a Dask client's; it is not shut down. None:
                processes of this machine.
            workers: the number of processes (None: one a processor), or of an executor's tasks (None: all).
            again: statuses ("failed", "lost", ...) of rows that are forgotten, so that their tasks run again.
            progress: called after each row, and now and then, with the numbers of rows and of tasks; an error
                from it ends the run, and all finished rows are in the file.
            disagreed: called at once with a sentence if a row has other contacts than one of its scene.

        Raises StudyStopped if another process runs this study, or the workers cannot go on, or have other
        versions: a later run can; RecordError if rows cannot be written; BadOption for a wrong status.
        """
        if workers is not None and workers < 1:
            raise BadOption(f"workers is {workers}; expected a number, at least 1")
        for status in again:
            if status not in STATUSES:
                raise BadOption(f"again is {status!r}; expected {one_of(status, STATUSES)}")
        file = RowFile(self.results)
        file.forget([])  # a file that cannot be written is reported before a task runs in vain
        with file.locked():
            file.forget([row["key"] for row in self.rows() if row["status"] in again])
            there = {row["key"]: row for row in self._read()[0]}
            todo = [task for key, task in self.tasks.items() if key not in there]
            agreement, done = Agreement(there.values()), len(there)
            with closing(rows_of(todo, executor, workers)) as rows:
                for row in rows:
                    if row is not None:
                        file.put(row)
                        done += 1
                        sentence = agreement.add(row)
                        if sentence is not None and disagreed is not None:
                            disagreed(sentence)
                    if progress is not None:
                        progress(done, len(self.tasks))
        return self.status()._replace(ran=done - len(there))

    def status(self) -> StudyStatus:
        """Returns the progress of the study."""
        rows, others = self._read()
        agreement = Agreement(rows)
        return StudyStatus(
            total=len(self.tasks),
            statuses=dict(Counter(agreement.judged(row)["status"] for row in rows)),
            open=len(self.tasks) - len(rows),
            ran=0,
            others=others,
            disagreements=tuple(agreement.disagreements),
        )

    def rows(self) -> list[Row]:
        """Returns the rows of all tasks that have one, in their order; their status may be "disagrees"."""
        rows, _ = self._read()
        return list(map(Agreement(rows).judged, rows))

    def _read(self) -> tuple[list[Row], int]:
        """Returns the rows of all tasks that have one, in their order, and the number of other rows. Their
        columns that describe the task are the study's: they do not depend on the file."""
        there = {row["key"]: row for row in RowFile(self.results).read()}
        tasks = [task for key, task in self.tasks.items() if key in there]
        rows = [there[task.key] | row_of(task, {"parameters": {**task.scene.parameters}}) for task in tasks]
        return rows, len(there) - len(rows)

    def table(self, y: str | None = None) -> dict[str, Any]:
        """Returns, for each scene and phase, the mean of a column over seeds, and its ratio to the mean of
        the first phase; ``y`` is the column (None: CPU seconds). Raises BadOption for one without numbers."""
        return summary_of(self.plan, self.rows(), y)
