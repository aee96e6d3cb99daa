"""What decides a question of time: pairs that agree by more than the machine can explain."""

from __future__ import annotations

import math

from hypothesis import given
from hypothesis import strategies as st

from kinetile_bench.thesis_statements.evidence import POWER, QUIET, Answer, Evidence, all_of, more_than_half

UNDECIDED = {Answer.NOT_QUIET, Answer.TOO_CLOSE, Answer.NOT_MEASURED}
ratios = st.lists(st.floats(0.01, 100.0), min_size=1, max_size=40)
answers = st.lists(st.sampled_from(Answer), min_size=1, max_size=8)


def evidence(found: list[float], unrest: float = 1.0) -> Evidence:
    return Evidence(tuple(map(math.log, found)), unrest)


def test_nine_of_ten_pairs_decide():
    assert evidence([0.9] * 27 + [1.5] * 3).below() is Answer.YES
    assert evidence([0.9] * 26 + [1.5] * 4).below() is Answer.TOO_CLOSE
    assert evidence([1.1] * 27 + [0.5] * 3).below() is Answer.NO
    assert evidence([0.97] * 30).below() is Answer.TOO_CLOSE
    assert evidence([0.5] * 30, unrest=1.2).below() is Answer.NOT_QUIET
    assert evidence([0.3] * 30, unrest=1.2).below() is Answer.YES


def test_a_spread_is_what_nine_of_ten_pairs_are_above_and_below():
    assert str(evidence([0.1] * 3 + [0.6] * 24 + [2.0] * 3)) == "0.6 (0.6-0.6)"
    assert str(evidence([0.5, 0.6, 0.7])) == "0.6 (0.5-0.7)"


@given(ratios, st.floats(1.0, 3.0))
def test_the_other_way_round_the_answer_is_the_opposite(found, unrest):
    opposite = {Answer.YES: Answer.NO, Answer.NO: Answer.YES}
    one = evidence(found, unrest)
    two = one._replace(logs=tuple(-each for each in one.logs))  # to the last bit: a ratio may be the margin
    assert two.below() is opposite.get(one.below(), one.below())


@given(ratios, st.lists(st.floats(1 / 1.02, 1.02), min_size=40, max_size=40))
def test_what_moves_a_time_by_less_than_the_margin_turns_no_answer(found, moved):
    before = evidence(found).below()
    after = evidence([a * b for a, b in zip(found, moved, strict=False)]).below()
    assert before is after or UNDECIDED & {before, after}


@given(ratios, st.floats(QUIET + 1e-6, 3.0))
def test_a_machine_that_is_not_quiet_decides_no_more_and_nothing_else(found, unrest):
    loud, still = evidence(found, unrest).below(), evidence(found).below()
    assert loud is still or loud is Answer.NOT_QUIET
    if loud in (Answer.YES, Answer.NO):
        assert max(found) > unrest**POWER or min(found) < unrest**-POWER


@given(answers)
def test_what_is_open_may_become_either(given_answers):
    for combine in (all_of, more_than_half):
        found = combine(given_answers)
        best = combine([Answer.YES if each in UNDECIDED else each for each in given_answers])
        worst = combine([Answer.NO if each in UNDECIDED else each for each in given_answers])
        assert found is best is worst or (found in UNDECIDED and best is not worst)
