"""Eight numbers at once, for hooks: the vectors of the processor (``kinetile.kernel.vectors``).

``Floats``, ``Wholes``, ``Ticks`` and ``Truths`` have the usual operators; a lane is one of the eight.
Built-in phases use them for bounds of many partners, for certificates of several neighbours, and to copy rows
of cells.
"""

from kinetile.kernel.vectors import LANES as LANES
from kinetile.kernel.vectors import Floats as Floats
from kinetile.kernel.vectors import Ticks as Ticks
from kinetile.kernel.vectors import Truths as Truths
from kinetile.kernel.vectors import Wholes as Wholes
from kinetile.kernel.vectors import append as append
from kinetile.kernel.vectors import bits as bits
from kinetile.kernel.vectors import choose as choose
from kinetile.kernel.vectors import eight as eight
from kinetile.kernel.vectors import fill as fill
from kinetile.kernel.vectors import flights as flights
from kinetile.kernel.vectors import followed as followed
from kinetile.kernel.vectors import lane as lane
from kinetile.kernel.vectors import lowest_bit as lowest_bit
from kinetile.kernel.vectors import number_in as number_in
from kinetile.kernel.vectors import numbered as numbered
from kinetile.kernel.vectors import numbers as numbers
from kinetile.kernel.vectors import pick as pick
from kinetile.kernel.vectors import places as places
from kinetile.kernel.vectors import root as root
from kinetile.kernel.vectors import some as some
from kinetile.kernel.vectors import spread as spread
from kinetile.kernel.vectors import spread_whole as spread_whole
from kinetile.kernel.vectors import to_floats as to_floats
from kinetile.kernel.vectors import turned as turned
