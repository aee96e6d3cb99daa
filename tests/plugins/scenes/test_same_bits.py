"""Recipes and runs have the same bits everywhere; pins change by the rule in docs/promises.md alone."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import kinetile_plugins
import recipe_bits

SCENES = {name: case.scene for name, case in recipe_bits.CASES.items()}
NOT_GROWN = {name: SCENES[name] for name, case in recipe_bits.CASES.items() if case.recipe != "grown"}
RUNS = {name: case.run for name, case in recipe_bits.CASES.items()} | {"kinetile run": recipe_bits.README_RUN}


def bits(*words: str, **environment: str) -> Any:
    told = subprocess.run(
        [sys.executable, recipe_bits.__file__, *words],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        timeout=900,
        check=True,
    )
    return json.loads(told.stdout)


def dispatched() -> list[str]:
    """Returns the processor's features, beyond those that it must have, that NumPy's functions use here."""
    core: Any = getattr(np, "_core", None) or np.core  # named so before NumPy 2
    inner = core._multiarray_umath
    return [each for each in inner.__cpu_dispatch__ if inner.__cpu_features__.get(each)]


def test_every_recipe_has_a_case() -> None:
    made = {spec.name for spec in kinetile_plugins.kinetile_scenes()} - {"frame"}  # whose bits are a file's
    assert {case.recipe for case in recipe_bits.CASES.values()} == made


def test_scenes_have_the_bits_that_are_promised() -> None:
    assert recipe_bits.scene_hashes(grown=False) == NOT_GROWN


@pytest.mark.slow
@pytest.mark.compiled
def test_scenes_that_are_grown_have_the_bits_that_are_promised() -> None:
    assert recipe_bits.scene_hashes() == SCENES


@pytest.mark.slow
def test_ratios_gave_other_bits_on_a_processor_with_fewer_features() -> None:
    features = dispatched()
    if not features:
        pytest.skip("NumPy uses no processor feature here that could be turned off")
    for first in range(len(features)):
        assert bits(NPY_DISABLE_CPU_FEATURES=" ".join(features[first:]))["scenes"] == NOT_GROWN


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="the setting is of the GNU C library")
def test_directions_had_other_bits_where_the_c_library_may_not_fuse_multiply_adds() -> None:
    without = "glibc.cpu.hwcaps=-FMA,-FMA4,-AVX2,-FMA_Usable,-AVX2_Usable"
    assert bits(GLIBC_TUNABLES=without)["scenes"] == NOT_GROWN


@pytest.mark.own_loop
@pytest.mark.compiled
def test_runs_have_the_fingerprints_that_are_promised() -> None:
    """In one loop, which has whatever a loop of discs and walls may have."""
    found = recipe_bits.fingerprints(in_one_loop=True)
    assert len(found) > 12
    assert found == {name: RUNS[name] for name in found}


@pytest.mark.slow
@pytest.mark.compiled
def test_runs_have_them_in_the_loops_of_their_scenes() -> None:
    assert recipe_bits.fingerprints() == RUNS


@pytest.mark.slow
def test_runs_have_these_fingerprints_with_fewer_features_of_the_processor() -> None:
    assert bits("run", NPY_DISABLE_CPU_FEATURES=" ".join(dispatched()))["runs"] == RUNS


@pytest.mark.slow
@pytest.mark.parametrize(
    "settings",
    [{"NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": ""}, *({"NUMBA_OPT": level} for level in "0123")],
    ids=lambda settings: " ".join(f"{name}={value}" for name, value in settings.items()),
)
def test_runs_have_these_fingerprints_however_they_are_compiled(
    settings: dict[str, str], tmp_path: Path
) -> None:
    """Machine code is compiled again: Numba's cache would serve what other settings have made."""
    assert bits("run", NUMBA_CACHE_DIR=str(tmp_path), **settings)["runs"] == RUNS
