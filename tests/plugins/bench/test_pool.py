"""Workers of a study: processes of this machine, executors, and Dask clusters of real processes, over TCP."""

from __future__ import annotations

import shutil
import subprocess
import sys
from concurrent.futures import BrokenExecutor, Executor
from pathlib import Path

import pytest

import studies
from clusters import cluster
from installing import install
from kinetile.errors import BadOption
from kinetile_bench import Study, pool

ROOT = Path(__file__).parents[3]
STRIPES = ROOT / "tests" / "foreign" / "kinetile-stripes"
TABLES = {"phases": ["naive"], "contacts": 5, "scenes": [{"recipe": "cradle"}]}


@pytest.mark.slow
def test_three_workers_of_dask_give_the_rows_of_this_machine_and_one_may_be_killed(tmp_path):
    pytest.importorskip("distributed")
    path = studies.write(tmp_path)
    with cluster(tmp_path, [[], [], []]) as (address, workers):
        assert address.startswith("tcp://127.0.0.1:")
        process = studies.begin("run", path, "--dask", address, "--workers", 3, "--json", folder=tmp_path)
        studies.wait_for_rows(process, tmp_path / "study.results", 10)
        workers[1].kill()
        studies.ended(process)
    assert {row["beside"] for row in studies.all_rows(path).values()} <= {0, 1, 2}
    here = studies.write(tmp_path / "here")
    studies.run_here(Study(here))
    assert studies.table(path) == studies.table(here)


@pytest.mark.slow
def test_a_worker_with_another_version_of_a_plugin_is_refused(tmp_path):
    pytest.importorskip("distributed")
    old = tmp_path / "old"
    shutil.copytree(STRIPES, old)
    project = old / "pyproject.toml"
    project.write_text(project.read_text().replace('version = "1.0.0"', 'version = "0.9.0"'))
    mine, theirs = install(STRIPES, tmp_path / "mine"), install(old, tmp_path / "theirs")
    path = studies.write(tmp_path, studies.STUDY.replace('"cells"', '"stripes"'))
    with cluster(tmp_path, [mine, theirs]) as (address, _):
        done = studies.study("run", path, "--dask", address, "--workers", 2, folder=tmp_path, paths=mine)
    assert done.returncode == 2
    assert "broad phase stripes is kinetile-stripes 0.9.0" in done.stderr
    assert "there, kinetile-stripes 1.0.0" in done.stderr
    assert "Traceback" not in done.stderr
    assert studies.rows_there(tmp_path / "study.results") == 0


def test_where_there_is_no_scheduler_the_message_says_what_was_expected(tmp_path, monkeypatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr(pool, "_DASK_TIMEOUT", 0.2)
    with pytest.raises(BadOption, match="expected the address of a scheduler"):
        Study(TABLES, tmp_path).run(dask="tcp://127.0.0.1:1")


def test_an_executor_that_breaks_ends_the_run_and_another_one_goes_on(tmp_path):
    class Broken(Executor):
        def submit(self, *_, **__):
            raise BrokenExecutor("gone")

    with pytest.raises(pool.PoolError, match="bring another one, and go on with that"):
        Study(TABLES, tmp_path).run(Broken(), workers=1)
    assert studies.status_here(Study(TABLES, tmp_path)).statuses == {"done": 1}


@pytest.mark.parametrize("how", [{"dask": "local"}, {"quiet_core": True}, {"workers": 0}], ids=str)
def test_two_kinds_of_workers_are_refused(tmp_path, how):
    with pytest.raises(BadOption, match="expected"):
        Study(TABLES, tmp_path).run(Executor(), **how)


@pytest.mark.slow
def test_a_script_without_its_guard_gets_the_line_that_is_missing(tmp_path):
    script = tmp_path / "script.py"
    script.write_text(f"import kinetile_bench\nkinetile_bench.Study({TABLES!r}, 'here').run(workers=1)\n")
    done = subprocess.run([sys.executable, script], cwd=tmp_path, capture_output=True, text=True, timeout=120)
    assert done.returncode == 1
    assert "must stand behind `if __name__ == '__main__':`" in done.stderr
