"""A picture by matplotlib: the same shapes in the same looks, on white; as PNG or PDF, or as pixels."""

import math
from importlib import import_module
from io import BytesIO
from typing import Any

import numpy as np
import numpy.typing as npt

from kinetile.errors import BadOption, answering
from kinetile.lazy import needed
from kinetile.plugin.drawing import Item, Segment
from kinetile.run.simulation import Simulation
from kinetile.scene.checks import shown
from kinetile.show.picture import LIGHT, LOOKS, NEXT_LOOK, ORDER, ROOM, Picture, corners_of, take_picture

INCHES = 6.9
"""The longer side of the picture: the text width of an A4 page."""

_DIGIT = 0.055
"""The width of a digit of a body's number, in inches."""

_MARGIN, _LINE, _FONT = 12, 20, 11  # in pixels of an image


def check_printing(purpose: str = "Drawing a picture as PNG or PDF") -> None:
    """Raises MissingExtra if pictures cannot be printed."""
    needed(purpose, "matplotlib", "figures")


def as_printed(picture: Picture, form: str, velocities: bool = False) -> bytes:
    """Returns a picture as a "png" or "pdf" file (``form``), with arrows of ``velocities`` if wanted.
    Raises MissingExtra without matplotlib."""
    check_printing()
    (left, bottom), (right, top) = picture.low, picture.high
    scale = INCHES / max(right - left, top - bottom)
    figure = import_module("matplotlib.figure").Figure(
        ((right - left) * scale, (top - bottom) * scale + 0.5), layout="constrained"
    )
    axes = figure.add_subplot(aspect="equal", xlim=(left, right), ylim=(bottom, top))
    arrows = f", arrows: the way in a time of {picture.arrow_time:g}" if velocities else ""
    axes.set_xlabel(picture.caption + arrows, fontsize=8)
    _draw(axes, picture)
    _numbers(axes, picture, scale)
    if velocities:
        _arrows(axes, picture)
    _legend(figure, picture)
    undated = {"png": None, "pdf": {"CreationDate": None}}[form]
    return figure_bytes(figure, form, dpi=200, metadata=undated)


@answering
def plot(
    sim: Simulation,
    ax: Any = None,
    *,
    structure: bool = False,
    pairs: bool | None = None,
    velocities: bool = False,
) -> Any:
    """Draws a simulation as it is now on axes of matplotlib, without ``ax`` on pyplot's, in the scene's
    lengths, and returns the axes; with the shapes of the broad phase (``structure``; lines between ``pairs``,
    up to 400), and an arrow for each velocity, if wanted. Raises MissingExtra without matplotlib."""
    if ax is not None and not hasattr(ax, "add_patch"):
        raise BadOption(f"plot: ax is {shown(ax)}; expected axes of matplotlib, or None")
    check_printing("Drawing on axes")
    axes = import_module("matplotlib.pyplot").gca() if ax is None else ax
    picture = take_picture(sim, structure=structure, pairs=pairs)
    (left, bottom), (right, top) = picture.low, picture.high
    axes.set(aspect="equal", xlim=(left, right), ylim=(bottom, top))
    _draw(axes, picture)
    if velocities:
        _arrows(axes, picture)
    return axes


def figure_bytes(figure: Any, form: str, **options: Any) -> bytes:
    """Returns a figure of matplotlib as a file of this format, with options of its ``savefig``."""
    written = BytesIO()
    figure.savefig(written, format=form, **options)
    return written.getvalue()


def as_pixels(picture: Picture, width: int, caption: str) -> npt.NDArray[np.uint8]:
    """Returns a picture as an array of pixels, (height, width, 4), with a text below it; a picture taller
    than twice its width is drawn smaller."""
    (left, bottom), (right, top) = picture.low, picture.high
    inner = width - 2 * _MARGIN
    scale = min(inner / (right - left), 2 * inner / (top - bottom))
    wide, tall = (right - left) * scale, (top - bottom) * scale
    # The canvas has whole pixels: its size is rounded down.
    size = width + 0.25, math.ceil(tall) + 2 * _MARGIN + _LINE + 0.25
    figure = import_module("matplotlib.figure").Figure((size[0] / 72, size[1] / 72), dpi=72)
    place = (size[0] - wide) / 2 / size[0], 1 - (_MARGIN + tall) / size[1], wide / size[0], tall / size[1]
    axes = figure.add_axes(place, xlim=(left, right), ylim=(bottom, top))
    _draw(axes, picture)
    figure.text(_MARGIN / size[0], _MARGIN / size[1], caption, fontsize=_FONT)
    canvas = import_module("matplotlib.backends.backend_agg").FigureCanvasAgg(figure)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())


def _draw(axes: Any, picture: Picture) -> None:
    axes.set(xticks=[], yticks=[])
    for spine in axes.spines.values():
        spine.set_visible(picture.arena)
    for shape in picture.shapes:
        _add(axes, picture, shape)
    patches = import_module("matplotlib.patches")
    for disc in picture.discs:
        look = {"fc": disc.colour, "ec": LIGHT.edge, "lw": 0.8, "zorder": 8}
        circle = disc.shape is None
        axes.add_patch(
            patches.Circle(disc.at, disc.radius, **look) if circle else patches.Polygon(disc.outline, **look)
        )


def _add(axes: Any, picture: Picture, shape: Item) -> None:
    patches, lines = import_module("matplotlib.patches"), import_module("matplotlib.lines")
    is_next = picture.is_next(shape)
    look = NEXT_LOOK if is_next else LOOKS[shape.role]
    height = 10 * LOOKS[shape.role].over + ORDER.index(shape.role) + 0.5 * is_next
    line = look.colour, look.strength
    dashes = (0, look.dashes) if look.dashes else "-"
    drawn = {"lw": look.width, "linestyle": dashes, "zorder": height}
    if isinstance(shape, Segment):
        axes.add_line(lines.Line2D(*zip(*corners_of(shape), strict=True), color=line, **drawn))
        return
    colours = {"ec": line, "fc": (look.colour, look.filled)}
    axes.add_patch(patches.Polygon(corners_of(shape), **colours, **drawn))


def _numbers(axes: Any, picture: Picture, scale: float) -> None:
    least = 0.5 * ROOM * _DIGIT * max((len(str(disc.number)) for disc in picture.discs), default=1)
    look = {"fontsize": 7, "ha": "center", "va": "center", "zorder": 20, "clip_on": True}
    for disc in picture.discs:
        if disc.room * scale >= least:
            axes.text(*disc.at, str(disc.number), **look)


def _arrows(axes: Any, picture: Picture) -> None:
    arrow = import_module("matplotlib.patches").FancyArrowPatch
    time, look = picture.arrow_time, {"arrowstyle": "->", "mutation_scale": 6, "shrinkA": 0, "shrinkB": 0}
    for disc in picture.discs:
        if any(disc.velocity):
            tip = tuple(x + v * time for x, v in zip(disc.at, disc.velocity, strict=True))
            axes.add_patch(arrow(disc.at, tip, zorder=9, **look))


def _legend(figure: Any, picture: Picture) -> None:
    patch, looks = import_module("matplotlib.patches").Patch, picture.looks
    swatches = [patch(fc=colour, ec=LIGHT.edge, label=word) for word, colour in picture.colours]
    swatches += [patch(fc=(look.colour, look.filled), ec=look.colour, label=name) for name, look in looks]
    if swatches:
        figure.legend(
            handles=swatches, loc="outside lower center", ncols=len(swatches), fontsize=8, frameon=False
        )
