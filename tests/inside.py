"""The objects behind the public class: the only place from which tests reach them."""

import kinetile as kt
from kinetile.run.engine.engine import Engine


def engine_of(simulation: kt.Simulation) -> Engine:
    """Returns the engine, whose tables may be written."""
    return simulation._engine
