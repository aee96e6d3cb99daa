"""The web without empty slots: the same tiling, its bodies counted from 0, for an audit that need not know of
any other."""

from __future__ import annotations

from typing import Any

import numpy as np

from kinetile.toolbox import Kernel

from .web import ENDS, LOWER, UPPER, State

__all__ = ["closed_up"]


def closed_up(k: Kernel, s: State, there: Any) -> tuple[Kernel, State]:
    """Return tables and web of the bodies in these slots alone. A place that names an empty slot names a body
    that there is not, and so shows in the audit."""
    n, m = len(s.level), len(there)
    body = np.full(n + 2, m + 2, dtype=np.int64)
    body[there] = np.arange(m)
    body[n], body[n + 1] = m, m + 1
    web = s.web.astype(np.int64).reshape(n + 1, 16)[np.append(there, n)]
    ends = np.zeros(16, dtype=bool)
    ends[[ENDS + UPPER, ENDS + LOWER, 8 + ENDS + UPPER, 8 + ENDS + LOWER]] = True
    links = np.zeros(16, dtype=bool)
    links[[0, 1, 2, 8, 9, 10]] = True
    web[:, ends] = body[np.minimum(web[:, ends], n + 1)]
    port = web[:, links]
    web[:, links] = body[np.minimum(port >> 4, n + 1)] << 4 | port & 15
    due = s.due.reshape(n + 1, 4)[np.append(there, n)]
    bodies, queue, clock = k.bodies[there], k.queue[there], k.clock.copy()
    clock[0].bodies = m
    return (
        k._replace(bodies=bodies, queue=queue, clock=clock, near=np.zeros_like(k.near)),
        s._replace(web=web.ravel().astype(np.uint32), due=due.ravel(), level=np.zeros(m, dtype=np.int32)),
    )
