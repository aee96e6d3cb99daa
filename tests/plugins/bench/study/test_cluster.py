"""A study on a Dask cluster of real processes, over TCP, gives the rows that it gives here."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

import studies
from clusters import cluster
from installing import install

ROOT = Path(__file__).parents[4]
STRIPES = ROOT / "tests" / "foreign" / "kinetile-stripes"

pytest.importorskip("distributed")


@pytest.fixture(scope="module")
def here(tmp_path_factory):
    """The table of an undisturbed run in processes of this machine."""
    folder = tmp_path_factory.mktemp("here")
    path = studies.write(folder)
    done = studies.study("run", path, "--workers", 2, "--json", folder=folder)
    assert done.returncode == 0, done.stderr
    return studies.sorted_rows(path, folder)


def test_three_workers_give_the_table_of_this_machine_and_one_may_be_killed(tmp_path, here):
    path = studies.write(tmp_path)
    with cluster(tmp_path, [[], [], []]) as (address, workers):
        assert address.startswith("tcp://127.0.0.1:")
        process = studies.begin("run", path, "--dask", address, "--workers", 3, "--json", folder=tmp_path)
        studies.wait_for_rows(process, tmp_path / "study.results", 10)
        workers[1].kill()
        out, error = process.communicate(timeout=240)
        assert process.returncode == 0, (out, error)
    rows = studies.all_rows(path).values()
    assert {row["beside"] for row in rows} <= {0, 1, 2}
    assert studies.sorted_rows(path, tmp_path) == here


def test_a_worker_with_another_version_of_a_plugin_is_refused(tmp_path):
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


def test_where_there_is_no_scheduler_it_says_what_was_expected(tmp_path):
    path = studies.write(tmp_path)
    done = studies.study("run", path, "--dask", "tcp:/127.0.0.1:1", folder=tmp_path)
    assert done.returncode == 2
    assert "expected the address of a scheduler" in done.stderr
