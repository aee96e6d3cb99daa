"""Exact ticks, for narrow phases: of two bodies that touch and part, or reach a wall, also through images.

``plans_of`` makes one value from the flight plans of two bodies, and ``plans_through`` one for an image.
Discs (``touch``, ``parting``; ``touch_about`` and ``accelerated_touch_about``, if a bound is known) and
convex bodies (``enters``, ``leaves``) take this value; walls take coordinates (``reaches_edge``). The
difference of two convex shapes is a row of a table (``difference_table``, ``comes_nearer``), whose columns
are named here. Along periodic axes ``first_image_of`` visits all images.
"""

from kinetile.kernel.certificates.discs import accelerated_touch_about as accelerated_touch_about
from kinetile.kernel.certificates.discs import parting as parting
from kinetile.kernel.certificates.discs import touch as touch
from kinetile.kernel.certificates.discs import touch_about as touch_about
from kinetile.kernel.certificates.plans import Axis as Axis
from kinetile.kernel.certificates.plans import Plans as Plans
from kinetile.kernel.certificates.plans import are_accelerated as are_accelerated
from kinetile.kernel.certificates.plans import plans_of as plans_of
from kinetile.kernel.certificates.plans import plans_through as plans_through
from kinetile.kernel.certificates.shapes import comes_nearer as comes_nearer
from kinetile.kernel.certificates.shapes import enters as enters
from kinetile.kernel.certificates.shapes import leaves as leaves
from kinetile.kernel.certificates.shapes_exactly import CORNERS as CORNERS
from kinetile.kernel.certificates.shapes_exactly import CX as CX
from kinetile.kernel.certificates.shapes_exactly import CY as CY
from kinetile.kernel.certificates.shapes_exactly import FIRST_CORNER as FIRST_CORNER
from kinetile.kernel.certificates.shapes_exactly import FLUSH as FLUSH
from kinetile.kernel.certificates.shapes_exactly import NX as NX
from kinetile.kernel.certificates.shapes_exactly import NY as NY
from kinetile.kernel.certificates.shapes_exactly import OUT as OUT
from kinetile.kernel.certificates.shapes_exactly import PLAIN as PLAIN
from kinetile.kernel.certificates.shapes_exactly import RADIUS as RADIUS
from kinetile.kernel.certificates.shapes_exactly import RANK as RANK
from kinetile.kernel.certificates.shapes_exactly import WIDE as WIDE
from kinetile.kernel.certificates.structural import FAR as FAR
from kinetile.kernel.certificates.walls import reaches_edge as reaches_edge
from kinetile.kernel.compiled import Numbers as Numbers
from kinetile.kernel.compiled import pointer as pointer
from kinetile.kernel.compiled import with_accelerations as with_accelerations
from kinetile.kernel.compiled import with_shapes as with_shapes
from kinetile.kernel.images import HALVES as HALVES
from kinetile.kernel.images import discs_overlap as discs_overlap
from kinetile.kernel.images import discs_touch as discs_touch
from kinetile.kernel.images import first_image_of as first_image_of
from kinetile.kernel.images import have_just_met as have_just_met
from kinetile.kernel.images import near_zero as near_zero
from kinetile.kernel.images import nearest_whole as nearest_whole
from kinetile.kernel.images import turns_between as turns_between
from kinetile.kernel.passings import counts_from as counts_from
from kinetile.toolbox.differences import difference_table as difference_table
