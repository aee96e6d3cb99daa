"""A picture as PNG or PDF, by matplotlib: the same shapes in the same looks, on white."""

from __future__ import annotations

from importlib import import_module
from io import BytesIO
from typing import Any

from kinetile.errors import MissingExtra
from kinetile.plugin.drawing import Item, Segment
from kinetile.show.picture import LIGHT, LOOKS, NEXT, ORDER, Picture, corners_of

INCHES = 6.9
"""The longer side of what is shown: the text width of an A4 page."""

_READABLE = 0.09
"""The least radius in inches of bodies that show their number."""


def check_printing() -> None:
    """Raises MissingExtra where pictures cannot be printed."""
    try:
        import_module("matplotlib")
    except ImportError as error:
        raise MissingExtra("Drawing a picture as PNG or PDF", "matplotlib", "figures") from error


def as_printed(picture: Picture, form: str, velocities: bool = False) -> bytes:
    """Returns a picture as a file of a form, "png" or "pdf", with an arrow for each velocity if wanted.

    Raises MissingExtra without matplotlib.
    """
    check_printing()
    (left, bottom), (right, top) = picture.low, picture.high
    scale = INCHES / max(right - left, top - bottom)
    figure = import_module("matplotlib.figure").Figure(
        ((right - left) * scale, (top - bottom) * scale + 0.5), layout="constrained"
    )
    axes = figure.add_subplot(aspect="equal", xlim=(left, right), ylim=(bottom, top))
    axes.set(xticks=[], yticks=[], title="")
    axes.set_xlabel(picture.caption, fontsize=8)
    for spine in axes.spines.values():
        spine.set_visible(picture.arena)
    for shape in picture.shapes:
        _add(axes, picture, shape)
    _discs(axes, picture, scale)
    if velocities:
        _arrows(axes, picture)
    _legend(figure, picture)
    written = BytesIO()
    undated = {"png": None, "pdf": {"CreationDate": None}}[form]
    figure.savefig(written, format=form, dpi=200, metadata=undated)
    return written.getvalue()


def _add(axes: Any, picture: Picture, shape: Item) -> None:
    patches, lines = import_module("matplotlib.patches"), import_module("matplotlib.lines")
    is_next, look = picture.is_next(shape), LOOKS[shape.role]
    height = (10 if look.over else 0) + ORDER.index(shape.role) + (0.5 if is_next else 0.0)
    look = NEXT if is_next else look
    dashes = (0, look.dashes) if look.dashes else "-"
    if isinstance(shape, Segment):
        (x, y), (to_x, to_y) = corners_of(shape)
        axes.add_line(
            lines.Line2D(
                (x, to_x), (y, to_y), color=look.colour, lw=look.width, linestyle=dashes, zorder=height
            )
        )
        return
    drawn = {"ec": look.colour, "lw": look.width, "linestyle": dashes, "zorder": height}
    axes.add_patch(patches.Polygon(corners_of(shape), fc=(look.colour, look.filled), **drawn))


def _discs(axes: Any, picture: Picture, scale: float) -> None:
    patches = import_module("matplotlib.patches")
    halo = [import_module("matplotlib.patheffects").withStroke(linewidth=2, foreground=LIGHT.disc)]
    for disc in picture.discs:
        look = {"fc": LIGHT.disc, "ec": LIGHT.edge, "lw": 0.8, "zorder": 8}
        circle = disc.shape is None
        axes.add_patch(
            patches.Circle(disc.at, disc.radius, **look) if circle else patches.Polygon(disc.outline, **look)
        )
        if disc.room * scale >= _READABLE:
            axes.text(
                *disc.at,
                str(disc.number),
                fontsize=7,
                ha="center",
                va="center",
                zorder=20,
                path_effects=halo,
                clip_on=True,
            )


def _arrows(axes: Any, picture: Picture) -> None:
    arrow = import_module("matplotlib.patches").FancyArrowPatch
    time = picture.arrow_time
    for disc in picture.discs:
        if any(disc.velocity):
            tip = tuple(x + v * time for x, v in zip(disc.at, disc.velocity, strict=True))
            axes.add_patch(
                arrow(disc.at, tip, arrowstyle="->", mutation_scale=6, shrinkA=0, shrinkB=0, zorder=9)
            )


def _legend(figure: Any, picture: Picture) -> None:
    patch = import_module("matplotlib.patches").Patch
    looks = [(role, LOOKS[role]) for role in picture.roles]
    looks += [("fails next", NEXT)] if picture.next is not None else []
    swatches = [patch(fc=(look.colour, look.filled), ec=look.colour, label=name) for name, look in looks]
    if swatches:
        figure.legend(
            handles=swatches, loc="outside lower center", ncols=len(swatches), fontsize=8, frameon=False
        )
