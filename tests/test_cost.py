"""The default lane is no dearer than ``cost`` says, by counts that are the same on each machine."""

import pytest

import cost


@pytest.mark.parametrize("what", cost.DEFAULT)
def test_a_change_made_the_default_lane_dearer(what):
    said = cost.DEFAULT[what]
    assert cost.counts[what] <= 1.1 * said, (
        f"{cost.counts[what]:,} {what}, and tests/cost.py says {said:,}: make scenes smaller, move cases to "
        "the slow lane (lanes.first), or change that number and say why"
    )
