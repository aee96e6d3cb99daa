"""Studies: a table of scenes, phases and seeds, run task by task, on one machine or many.

* ``file``: the study file, and the tasks that it comes to;
* ``work``: one task, done in whatever process;
* ``store``: the rows, a Parquet dataset that survives being killed;
* ``engines``: processes of this machine, any executor, a Dask cluster;
* ``results``: tables, fits and figures of the rows;
* ``shipped``: study files that come with kinetile.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from kinetile_bench.study.study import Study as Study

__all__ = ["Study"]


def __getattr__(name: str) -> Any:
    if name != "Study":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from kinetile_bench.study.study import Study

    return Study
