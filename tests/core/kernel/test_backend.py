"""What kinetile uses of Numba that is not public: the self-test, and the versions that it is known for."""

import re
import tomllib
from pathlib import Path

import pytest

from kinetile.kernel.compiled import backend


def test_the_versions_of_numba_are_those_of_the_package():
    project = tomllib.loads((Path(__file__).parents[3] / "pyproject.toml").read_text())["project"]
    assert f"numba{backend.VERSIONS}" in project["dependencies"]
    low, below = (tuple(map(int, each)) for each in re.findall(r"(\d+)\.(\d+)", backend.VERSIONS))
    assert low <= tuple(map(int, backend.numba.__version__.split(".")[:2])) < below


@pytest.mark.parametrize("part", backend.MEMBERS)
def test_a_member_that_a_later_numba_has_not_is_named_in_one_sentence(monkeypatch, part):
    """Each part: a class, of which some attributes are set in its methods alone, or a module."""
    backend.check()
    monkeypatch.setitem(backend.MEMBERS, part, f"{backend.MEMBERS[part]} _of_another_version")
    with pytest.raises(ImportError, match=r"_of_another_version; install numba>=[\d.]+,<[\d.]+$") as error:
        backend.check()
    assert "\n" not in str(error.value)
    assert f"{part.__name__} has no " in str(error.value)
