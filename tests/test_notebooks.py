"""The notebooks in docs/notebooks: they are kept without outputs, and run from first cell to last."""

import json
import re
from itertools import pairwise
from pathlib import Path

import pytest

NOTEBOOKS = sorted((Path(__file__).parents[1] / "docs" / "notebooks").glob("*.ipynb"))
SHOWN = {"first-steps": 4, "a-broad-phase": 4, "living-scenes": 3, "sweep-line": 1}
"""How many cells of each show a table or a page at their end."""


def read(path):
    return json.loads(path.read_text(encoding="utf-8"))


def test_each_of_them_is_run():
    assert {path.stem for path in NOTEBOOKS} == set(SHOWN)


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_is_kept_as_it_is_written(path):
    notebook = read(path)
    assert (notebook["nbformat"], notebook["nbformat_minor"]) == (4, 5)
    assert notebook["metadata"]["kernelspec"]["name"] == "python3"
    cells = notebook["cells"]
    assert len({cell["id"] for cell in cells}) == len(cells)
    for cell in cells:
        if cell["cell_type"] == "code":
            assert (cell["outputs"], cell["execution_count"]) == ([], None)
    said = "\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "markdown")
    levels = [len(marks) for marks in re.findall("^(#+) ", said, re.MULTILINE)]
    assert levels[0] == 1
    assert levels.count(1) == 1
    assert all(now <= before + 1 for before, now in pairwise(levels))


@pytest.mark.compiled
@pytest.mark.parametrize(
    "path",
    [
        pytest.param(path, id=path.stem, marks=[] if path.stem == "first-steps" else pytest.mark.slow)
        for path in NOTEBOOKS
    ],
)
def test_a_notebook_runs_from_its_first_cell_to_its_last(path, tmp_path):
    reason = "notebooks are executed with nbclient and ipykernel: pip install 'kinetile[notebooks]'"
    nbformat = pytest.importorskip("nbformat", reason=reason)
    client = pytest.importorskip("nbclient", reason=reason)
    pytest.importorskip("ipykernel", reason=reason)
    notebook = nbformat.read(path, as_version=4)
    nbformat.validate(notebook)
    where = {"metadata": {"path": str(tmp_path)}}
    client.NotebookClient(notebook, timeout=600, kernel_name="python3", resources=where).execute()
    outputs = [each for cell in notebook.cells if cell.cell_type == "code" for each in cell.outputs]
    assert not [each for each in outputs if each.output_type == "stream" and each.name == "stderr"]
    shown = [each.data["text/html"] for each in outputs if "text/html" in each.get("data", {})]
    assert len(shown) == SHOWN[path.stem]
    assert not any("cannot be shown" in each for each in shown)
    assert not list(tmp_path.iterdir())
