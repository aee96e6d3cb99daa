"""Observables on the command line: as a table, as JSON, in files."""

import csv
import math

import pytest

import kinetile as kt
from command_line import kinetile, printed
from lanes import first

OBSERVE = ["pressure", "rates:every=0.5", "msd:every=0.5,lags=2"]
RUN = f"run grid -s bodies=4 --broad-phase naive --until 2 --observe {','.join(OBSERVE)}"


def observed() -> list:
    sim = kt.Simulation(kt.make_scene("grid", bodies=4), "naive")
    sim.run(2.0, observe=OBSERVE)
    return sim.observed.rows()


def test_json_has_the_estimates_of_a_simulation():
    found = printed(RUN)["observed"]
    rows = [row._asdict() for row in observed()]
    walls = [f"P_{wall}" for wall in ("left", "right", "bottom", "top")]
    names = ["P", "kT", "P/kT", "Z", *walls, "pairs", "walls", "Gamma", *["msd"] * 3]
    assert [row["quantity"] for row in found] == names
    assert [row["at"] for row in found[-3:]] == [0.0, 0.5, 1.0]
    for row, expected in zip(found, rows, strict=True):
        if not expected["blocks"]:  # NaN in the run, null in JSON: too short for an error
            assert (row.pop("error"), math.isnan(expected.pop("error"))) == (None, True)
        assert row == pytest.approx(expected)


def test_the_table_has_numbers_with_errors_and_the_length_of_curves():
    said = kinetile(RUN).stdout
    assert "standard error" in said
    assert "3 values over time" in said


def test_a_file_has_all_rows(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    kinetile(f"{RUN} --observe-to out.csv")
    with open("out.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    for expected, row in zip(observed(), rows, strict=True):
        assert float(row["mean"]) == pytest.approx(expected.mean, rel=1e-9, abs=1e-12)
        assert (row["observable"], row["at"]) == (
            expected.observable,
            "" if expected.at is None else str(expected.at),
        )


@pytest.mark.parametrize("form", first(1, ["svg", "png", "pdf"]))
def test_curves_are_drawn(tmp_path, form):
    pytest.importorskip("matplotlib")
    kinetile(f"{RUN} --observe-to {tmp_path}/out.{form}")
    content = (tmp_path / f"out.{form}").read_bytes()
    assert {"svg": b"<svg", "png": b"PNG", "pdf": b"%PDF"}[form] in content
