"""An engine at one moment, which can be restored at the price of a copy: for refused commands, which leave it
unchanged, and for snapshots."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from types import SimpleNamespace
from typing import Any, Self

from kinetile.arrays import Array
from kinetile.run.engine import layout
from kinetile.run.engine.bounds import NO_SKIN
from kinetile.run.engine.commands import Agenda, Planned
from kinetile.run.engine.engine import Engine
from kinetile.run.engine.ledger import Entries
from kinetile.run.engine.state import USED, RunState, contents_of
from kinetile.run.interrupts import Unbroken


@dataclass(frozen=True, eq=False)
class Kept:
    """An engine at one moment, with its structure: its attributes, its tables with copies of their contents,
    the clock's base, and the contents of ledger and agenda."""

    engine: Engine
    values: Mapping[str, Any]
    tables: list[tuple[Array, Array]]
    base: int
    entries: Entries
    later: Planned

    @cached_property
    def state(self) -> RunState:
        """The state of the run at that moment."""
        was, of_then = SimpleNamespace(**self.values), {id(table): content for table, content in self.tables}
        alike = ("commands", "history", "overlapping", "audits", *USED)
        k = was._k._replace(
            **{
                name: of_then[id(table)].view(table.dtype).view(type(table))
                for name, table in was._k._asdict().items()
                if id(table) in of_then
            }
        )
        return RunState(
            contents=contents_of(k),
            base=self.base,
            bounds=was.bounds._replace(extent=0.0, skin=NO_SKIN),
            later=self.later,
            entries=self.entries,
            requested=was._requested,
            shapes=was.scene.shapes[was._listed :],
            pull=None if was.scene.uniform else was.scene.pull,
            **{name: self.values[name] for name in alike},
        )

    @classmethod
    def of(cls, engine: Engine) -> Self:
        """Returns the present engine, between two chunks."""
        names = [name for name in engine.k._fields if name not in ("met", "log")]
        tables = [*(getattr(engine.k, name) for name in names), *engine.state]
        return cls(
            engine,
            dict(vars(engine)),
            [(table, layout.as_bytes(table).copy()) for table in tables if table.flags.writeable],
            engine.clock.base,
            engine.ledger.entries,
            engine.agenda.later,
        )

    def go_back(self) -> None:
        """Restores the engine: its own tables get the contents of that moment."""
        engine = self.engine
        vars(engine).update(self.values)
        for table, content in self.tables:
            layout.as_bytes(table)[...] = content
        engine.clock.base, engine.ledger.entries, engine.agenda = self.base, self.entries, Agenda(self.later)
        engine.forget_taken()


@contextmanager
def unchanged_if(engine: Engine, errors: type[BaseException]) -> Iterator[None]:
    """Within this context such an error leaves an engine unchanged. Costs a copy of all tables."""
    kept = Kept.of(engine)
    try:
        with Unbroken():
            yield
    except errors:
        kept.go_back()
        raise
