"""The toolbox of plugin authors: everything that a hook may call, in one place.

Built-in phases use this package and nothing else of the kernel (an import contract enforces this). The usual
functions are here, exact ticks of contacts in ``toolbox.ticks``, vectors of eight in ``toolbox.lanes``.

A hook receives the kernel's tables as ``k`` (see ``kinetile.kernel.tables``) and, in a broad phase, its own
state as ``s``.
"""

from typing import TYPE_CHECKING

from kinetile.lazy import lazy_names

if TYPE_CHECKING:
    from kinetile.kernel.certificates.dues import first_due as first_due
    from kinetile.kernel.certificates.dues import no_dues as no_dues
    from kinetile.kernel.certificates.dues import set_due as set_due
    from kinetile.kernel.certificates.quadratic import falls_bent as falls_bent
    from kinetile.kernel.certificates.structural import falls as falls
    from kinetile.kernel.certificates.structural import falls_eight as falls_eight
    from kinetile.kernel.certificates.structural import falls_many as falls_many
    from kinetile.kernel.certificates.structural import first_rise as first_rise
    from kinetile.kernel.certificates.structural import schedule as schedule
    from kinetile.kernel.certificates.structural import ticks_after as ticks_after
    from kinetile.kernel.certificates.walls import inside_accelerated as inside_accelerated
    from kinetile.kernel.certificates.walls import inside_arena as inside_arena
    from kinetile.kernel.compiled import hook as hook
    from kinetile.kernel.compiled import larger as larger
    from kinetile.kernel.compiled import smaller as smaller
    from kinetile.kernel.compiled import unchecked as unchecked
    from kinetile.kernel.compiled import with_constants as with_constants
    from kinetile.kernel.flight import closing_speed as closing_speed
    from kinetile.kernel.flight import give as give
    from kinetile.kernel.flight import position_after as position_after
    from kinetile.kernel.flight import position_at as position_at
    from kinetile.kernel.flight import positions_now as positions_now
    from kinetile.kernel.flight import shared as shared
    from kinetile.kernel.flight import since_anchor as since_anchor
    from kinetile.kernel.flight import since_origin as since_origin
    from kinetile.kernel.flight import since_touched as since_touched
    from kinetile.kernel.flight import velocity_at as velocity_at
    from kinetile.kernel.log import BOTTOM as BOTTOM
    from kinetile.kernel.log import LEFT as LEFT
    from kinetile.kernel.log import RIGHT as RIGHT
    from kinetile.kernel.log import TOP as TOP
    from kinetile.kernel.log import WALLS as WALLS
    from kinetile.kernel.loop.idle import NoState as NoState
    from kinetile.kernel.pairs import add_pair as add_pair
    from kinetile.kernel.pairs import held_pairs as held_pairs
    from kinetile.kernel.pairs import offer as offer
    from kinetile.kernel.pairs import pairs_of as pairs_of
    from kinetile.kernel.pairs import remove_pair as remove_pair
    from kinetile.kernel.plan import Plan as Plan
    from kinetile.kernel.plan import positions_after as positions_after
    from kinetile.kernel.rest import rest as rest
    from kinetile.kernel.rest import rests_on as rests_on
    from kinetile.kernel.rest import support_velocity as support_velocity
    from kinetile.kernel.skin import box_gaps as box_gaps
    from kinetile.kernel.skin import reach_to as reach_to
    from kinetile.kernel.skin import reaches_of as reaches_of
    from kinetile.kernel.tables import MY_FAULT as MY_FAULT
    from kinetile.kernel.tables import NEVER as NEVER
    from kinetile.kernel.tables import NOBODY as NOBODY
    from kinetile.kernel.tables import TOO_DEEP as TOO_DEEP
    from kinetile.kernel.tables import Kernel as Kernel
    from kinetile.kernel.tables import Records as Records
    from kinetile.kernel.tables import blame as blame
    from kinetile.kernel.tables import is_there as is_there
    from kinetile.kernel.tables import record_table as record_table
    from kinetile.kernel.vectors import prefetch as prefetch
    from kinetile.plugin.drawing import At as At
    from kinetile.plugin.drawing import Box as Box
    from kinetile.plugin.drawing import Coordinate as Coordinate
    from kinetile.plugin.drawing import Entry as Entry
    from kinetile.plugin.drawing import Item as Item
    from kinetile.plugin.drawing import Link as Link
    from kinetile.plugin.drawing import Point as Point
    from kinetile.plugin.drawing import Polygon as Polygon
    from kinetile.plugin.drawing import Segment as Segment
    from kinetile.plugin.drawing import pair_links as pair_links
    from kinetile.plugin.protocols import BroadPhase as BroadPhase
    from kinetile.plugin.protocols import BroadPhaseParts as BroadPhaseParts
    from kinetile.plugin.protocols import ContactResponse as ContactResponse
    from kinetile.plugin.protocols import NarrowPhase as NarrowPhase
    from kinetile.plugin.protocols import PairParts as PairParts
    from kinetile.plugin.protocols import ResponseParts as ResponseParts
    from kinetile.plugin.protocols import WallParts as WallParts
    from kinetile.toolbox.reach import reach_of as reach_of

__all__, __getattr__ = lazy_names(__name__)
