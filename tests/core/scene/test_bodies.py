"""Arrays that would lose something on the way into a scene are refused: masks, parts, digits."""

import math

import numpy as np
import pytest

from kinetile import Scene
from kinetile.errors import SceneError

REST = [[0.0, 0.0], [0.0, 0.0]]
APART = [[0.0, 0.0], [5.0, 0.0]]
WIDE = np.dtype(np.longdouble).itemsize > 8


def message_of(**fields: object) -> str:
    with pytest.raises(SceneError) as caught:
        Scene(**{"position": APART, "velocity": REST, "radius": 1.0, **fields})
    return str(caught.value)


def test_a_masked_array_that_masks_nothing_is_an_array() -> None:
    scene = Scene(np.ma.array(APART), REST, np.ma.array([1.0, 2.0], mask=[False, False]))
    assert scene == Scene(APART, REST, [1.0, 2.0])


def test_whole_numbers_that_are_floats_are_taken() -> None:
    for number in (2**53, 2**62, -(2**63)):
        assert Scene(np.array([[0, 0], [number, 0]]), REST, 1.0).position[1, 0] == float(number)
    large = np.array([[0, 0], [2**63 + 2**20, 0]], dtype=np.uint64)
    assert Scene(large, REST, 1.0).position[1, 0] == 2.0**63 + 2.0**20


@pytest.mark.skipif(not WIDE, reason="the long double of this platform is a double")
def test_wider_floats_were_rounded_without_a_word() -> None:
    third = np.longdouble(1) / 3
    assert "of the type longdouble" in message_of(radius=np.array([third, 1])).replace(
        str(np.dtype(np.longdouble)), "longdouble"
    )
    assert "radius: found " in message_of(radius=np.array([np.longdouble(2) ** 2000, 1]))
    assert Scene(APART, REST, np.array([0.5, 1], dtype=np.longdouble)).radius.tolist() == [0.5, 1.0]
    assert "two finite numbers" in message_of(position=np.array([[0, 0], [math.nan, 0]], dtype=np.longdouble))


def test_narrower_floats_are_taken_as_they_are() -> None:
    assert Scene(APART, REST, np.array([0.1, 1], dtype=np.float32)).radius[0] == float(np.float32(0.1))
