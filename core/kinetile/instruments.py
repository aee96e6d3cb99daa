"""The names that instruments, which check, measure or show kinetile, may use beside ``kinetile``,
``kinetile.errors`` and ``kinetile.toolbox``. By an import contract, the instruments of this distribution
import only these and four modules of ``kinetile.cli``, so a foreign instrument can do the same."""

from typing import TYPE_CHECKING

from kinetile.lazy import lazy_names

if TYPE_CHECKING:
    from kinetile.comparison import Outcome, describe_row, find_divergence, first_difference, outcome_of
    from kinetile.kernel.clock import SPAN, TICKS
    from kinetile.kernel.compiled import (
        NOTHING_IS_COMPILED,
        as_python,
        compiled_by_default,
        compiling_seconds,
        compose,
        disowned,
        make_ready,
        to_be_filled_in,
        while_compiling,
    )
    from kinetile.kernel.compiled.limits import end_after, limit_memory, out_of_time
    from kinetile.kernel.flight import note_all_places, position_at
    from kinetile.kernel.log import (
        ACCELERATED,
        HELD,
        INSERTED,
        MOVED,
        OF_KIND,
        REANCHORED,
        REMOVED,
        TURNED,
        Fingerprint,
        digestible,
    )
    from kinetile.kernel.passings import FIRST, rule_of
    from kinetile.kernel.tables import allocate, column, compared, fields_in, slots_taken
    from kinetile.plugin.calling import NOT_AUTHORS, is_library, line_of_author, place_of
    from kinetile.plugin.choices import read_phase, write_phase
    from kinetile.plugin.parameters import Parameter
    from kinetile.plugin.registry import Provided
    from kinetile.plugin.specs import PluginKind
    from kinetile.records.contacts import read_contacts
    from kinetile.records.log import SIGNATURE
    from kinetile.records.reading import read_with_scene
    from kinetile.run.audit import OWN, said_tick
    from kinetile.run.compose import Composition, check_options, compose_phases, read_narrow_phases
    from kinetile.run.interrupts import Unbroken
    from kinetile.run.observing import check_observable
    from kinetile.run.simulation import composition_of
    from kinetile.scene import Command, relabelled, with_commands
    from kinetile.scene.by_name import (
        complete_parameters,
        holds_several,
        parameter_mistakes,
        recipe_parameters,
    )
    from kinetile.scene.checks import abridged, shown
    from kinetile.scene.commands import COMMAND_KINDS
    from kinetile.scene.files import dumps_scene, loads_scene
    from kinetile.scene.schema import read_tables, read_text
    from kinetile.scene.values import VALUES, Value
    from kinetile.show.html import facts, figure, grid, paragraph
    from kinetile.show.picture import escape
    from kinetile.show.player import View, view_scene
    from kinetile.show.player.view import ShownPhase
    from kinetile.show.printed import figure_bytes
    from kinetile.sources import check_regular, open_regular
    from kinetile.targets import write_file
    from kinetile.versions import versions

_, __getattr__ = lazy_names(__name__)
