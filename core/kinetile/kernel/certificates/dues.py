"""Several certificates a body: a tree of their ticks, whose first tick is in the kernel's queue.

A table has a row for each body. For w certificates the last w numbers of the row are the ticks, and number v
before them is the lesser of 2 v and 2 v + 1. So number 1 is the first of all.
"""

import numpy as np

from kinetile.kernel.certificates.structural import Integers, schedule
from kinetile.kernel.compiled import hook, smaller
from kinetile.kernel.tables import NEVER, Kernel, Records


def no_dues(slots: int, certificates: int) -> Integers:
    """Returns a table for bodies with up to so many certificates each, filled with ``NEVER``, as ``build``
    requires. It belongs to the ``ticks`` of a phase."""
    return np.full((slots, 2 * max(certificates, 1)), NEVER, np.int64)


@hook
def set_due(k: Kernel, due: Records, body: int, which: int, tick: int) -> None:
    """Sets the failure tick of certificate ``which``, from 0 on, of a body, and schedules the body's first
    failure. O(log of their number)."""
    at = which + due.shape[1] // 2
    due[body, at] = tick
    while at > 1:
        at //= 2
        due[body, at] = smaller(due[body, 2 * at], due[body, 2 * at + 1])
    schedule(k, body, due[body, 1])


@hook
def first_due(due: Records, body: int) -> int:
    """Returns the number of a body's certificate that fails first: in ``repair`` the one that fails now."""
    first = due.shape[1] // 2
    at = 1
    while at < first:
        at *= 2
        if due[body, at + 1] < due[body, at]:
            at += 1
    return int(at - first)
