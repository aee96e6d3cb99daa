"""Every mutant that has a witness is wrong on it, without the kit; what they are made from is not."""

from __future__ import annotations

from collections import Counter

import pytest

from mutants import HARMLESS, MUTANTS
from mutants.witnesses import Differs
from phase_mutants import Mutant

pytestmark = pytest.mark.long


@pytest.mark.parametrize("mutant", [m for m in MUTANTS if m.witness], ids=lambda m: m.label)
def test_a_mutant_is_wrong_on_its_witness(mutant: Mutant, tmp_path_factory: pytest.TempPathFactory) -> None:
    mutant.load(tmp_path_factory.getbasetemp())
    assert mutant.witness is not None
    assert mutant.witness(mutant.label)


@pytest.mark.parametrize("mutant", [m for m in MUTANTS if type(m.witness) is Differs], ids=lambda m: m.label)
def test_its_base_is_right_there(mutant: Mutant) -> None:
    assert mutant.witness is not None
    assert mutant.witness(mutant.base) == ""


def test_every_mutant_has_a_name_of_its_own_and_loads(tmp_path_factory: pytest.TempPathFactory) -> None:
    labels = Counter(mutant.label for mutant in (*MUTANTS, *HARMLESS))
    assert [label for label, times in labels.items() if times > 1] == []
    for mutant in (*MUTANTS, *HARMLESS):
        mutant.load(tmp_path_factory.getbasetemp())
