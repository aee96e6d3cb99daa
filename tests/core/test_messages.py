"""Calls and keys that people try first, and names that cannot be used: the rows of ``messages.toml``."""

import sys

import pytest

import kinetile as kt
from messages import table

pytestmark = pytest.mark.small
BODY = "[[bodies]]\nposition = [0, 0]\nradius = 1\n"
COMMAND = "[[commands]]\ntime = 1\ninsert = {{ position = [9, 9], radius = 1, {} = 1 }}"
SAP = 'broad-phase = "sap-1d"\n'


@pytest.fixture
def sim():
    return kt.Simulation(kt.Scene([(1.0, 1.0)], [(1.0, 0.0)], 0.25, arena=(4.0, 4.0)), "naive")


def without(module, call):
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(sys.modules, module, None)
        call()


def without_hint(call):
    """Calls, and marks the end of the message."""
    try:
        call()
    except (AttributeError, kt.errors.BadOption) as error:
        raise type(error)(f"{error}$") from None


test_message = table(globals())
