"""Balls that fly into a sensor, one that arrives late, and what is known before an event."""

from typing import Any

import kinetile as kt

LATE = kt.Insert(1.0, (8.0, 8.0), (0.0, 2.0), 0.5, kind="late")


def world(**more: Any) -> kt.Scene:
    """Returns two balls that pass a sensor, at rest between them."""
    places, flies = [[1.0, 5.0], [5.0, 5.0], [5.0, 2.0]], [[2.0, 0.0], [0.0, 0.0], [0.0, 1.0]]
    rules = {"kind": ["ball", "sensor", "ball"], "responses": {("ball", "sensor"): "pass"}}
    return kt.Scene(places, flies, [0.1, 0.5, 0.25], arena=(10.0, 10.0), **rules, **more)


def foretold(event: kt.Event) -> kt.Event:
    """Returns an event as it is known before it happens: without its normal, closing speed and impulse."""
    return event._replace(normal=None, closing_speed=None, impulse=None)
