"""A picture as SVG, written directly: small, readable, the same bytes for the same picture, in light or dark
colours like the reader's system. A shape shows its label and its failure time under the mouse."""

from collections.abc import Iterable, Iterator
from itertools import groupby

from kinetile.kernel.plan import Plan, position_after
from kinetile.plugin.drawing import Box, Item, Polygon, Segment
from kinetile.show.picture import (
    DARK,
    LIGHT,
    LOOKS,
    NEXT_LOOK,
    ROOM,
    Paper,
    Picture,
    corners_of,
    escape,
    round_below,
)

LENGTH = 640.0
"""The longer side of the picture, in units of the file: points on a page, pixels on a screen."""

INSET = 12.0

LINE_HEIGHT = 20.0
"""The height of a line of the caption and the legend."""

_LETTER = 7.2
"""The approximate width of a letter of the caption."""

_ARROWHEAD = (
    '<marker id="head" viewBox="0 0 8 8" refX="8" refY="4" markerWidth="8" markerHeight="8" orient="auto" '
    'markerUnits="userSpaceOnUse"><path class="arena" d="M1 1L8 4L1 7"/></marker>'
)

_DIGIT = 6.7
"""As wide as a digit of a body's number is."""


def as_svg(picture: Picture, velocities: bool = False, bare: bool = False) -> bytes:
    """Returns a picture as an SVG file, with an arrow for each velocity if they are wanted; if ``bare``,
    without numbers, caption and legend."""
    sheet = _Sheet(picture)
    roles = picture.roles
    under = [role for role in roles if not LOOKS[role].over]
    over = [role for role in roles if LOOKS[role].over]
    body = [
        f'<clipPath id="frame"><rect x="{number(INSET)}" y="{number(INSET)}" '
        f"{_size(sheet.wide, sheet.tall)}/></clipPath>",
        '<g clip-path="url(#frame)">',
        *_layers(sheet, under),
        *_discs(sheet),
        "</g>",
        *((_ARROWHEAD, *_arrows(sheet)) if velocities else ()),  # arrows may reach over the border
        '<g clip-path="url(#frame)">',
        *_layers(sheet, over),
        *(() if bare else _numbers(sheet)),
        "</g>",
    ]
    if picture.arena:
        x, y = sheet.at(picture.low[0], picture.high[1])
        body.append(f'<rect class="arena" x="{x}" y="{y}" {_size(sheet.wide, sheet.tall)}/>')
    size, style = (sheet.wide, sheet.tall), _style(roles)
    if bare:
        return document(size, picture.caption, style, body, (), 0)
    legend, lines = _legend(sheet, [name for name, _ in picture.looks], velocities)
    return document(size, picture.caption, style, body, legend, 1 + lines)


def document(
    size: tuple[float, float],
    caption: str,
    style: str,
    body: Iterable[str],
    legend: Iterable[str],
    lines: int,
) -> bytes:
    """Returns an SVG file: its style sheet, and the paper with a body within a width and a height; below that
    so many lines: its caption, unless there are none, and a legend."""
    wide, tall = max(size[0], _LETTER * len(caption) if lines else 0.0) + 2 * INSET, size[1] + 2 * INSET
    text = f'<text x="{number(INSET)}" y="{number(tall + 0.6 * LINE_HEIGHT)}">{escape(caption)}</text>'
    paper = _size(wide, tall + LINE_HEIGHT * lines)
    words = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {number(wide)} '
        f'{number(tall + LINE_HEIGHT * lines)}" {paper} role="img" aria-labelledby="title">',
        f'<title id="title">{escape(caption)}</title>',
        f"<style>{style}</style>",
        f'<rect class="back" {paper}/>',
        *body,
        *([text] if lines else []),
        *legend,
        "</svg>",
        "",
    ]
    return "\n".join(words).encode()


class _Sheet:
    """The sheet, and the places of the scene's points on it: its y axis points down."""

    def __init__(self, picture: Picture) -> None:
        (left, bottom), (right, top) = picture.low, picture.high
        self.picture = picture
        self.scale = LENGTH / max(right - left, top - bottom)
        self.wide, self.tall = (right - left) * self.scale, (top - bottom) * self.scale

    def at(self, x: float, y: float) -> tuple[str, str]:
        (left, _), (_, top) = self.picture.low, self.picture.high
        return number(INSET + (x - left) * self.scale), number(INSET + (top - y) * self.scale)


def number(value: float) -> str:
    """Returns a number with as many digits as are visible."""
    text = f"{value:.2f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


def _size(wide: float, tall: float) -> str:
    return f'width="{number(wide)}" height="{number(tall)}"'


def _layers(sheet: _Sheet, roles: Iterable[str]) -> Iterator[str]:
    """Yields the shapes role by role; in each role, the shape that fails next is last."""
    picture = sheet.picture
    for role in roles:
        shapes = [shape for shape in picture.shapes if shape.role == role]
        shapes.sort(key=picture.is_next)
        yield f'<g class="{role}">'
        yield from (_shape(sheet, shape) for shape in shapes)
        yield "</g>"


def _shape(sheet: _Sheet, shape: Item) -> str:
    picture = sheet.picture
    look = ' class="next"' if picture.is_next(shape) else ""
    points = [sheet.at(x, y) for x, y in corners_of(shape)]
    if isinstance(shape, Segment):
        (x, y), (to_x, to_y) = points
        tag, drawn = "line", f'x1="{x}" y1="{y}" x2="{to_x}" y2="{to_y}"'
    elif isinstance(shape, Box):
        (left, low), _, (right, high), _ = corners_of(shape)
        x, y = sheet.at(left, high)
        wide, tall = max(right - left, 0.0) * sheet.scale, max(high - low, 0.0) * sheet.scale
        tag, drawn = "rect", f'x="{x}" y="{y}" {_size(wide, tall)}'
    else:
        assert isinstance(shape, Polygon)  # a picture has no links
        tag, drawn = "polygon", f'points="{" ".join(",".join(point) for point in points)}"'
    if not shape.label and shape.fails is None:
        return f"<{tag}{look} {drawn}/>"
    return f"<{tag}{look} {drawn}><title>{escape(picture.described(shape))}</title></{tag}>"


def _discs(sheet: _Sheet) -> Iterator[str]:
    discs = sorted(sheet.picture.discs, key=lambda disc: disc.colour)
    for colour, alike in groupby(discs, key=lambda disc: disc.colour):
        yield f'<g class="disc" fill="{colour}">'
        for disc in alike:
            if disc.shape is not None:
                yield f'<polygon points="{" ".join(",".join(sheet.at(*point)) for point in disc.outline)}"/>'
            else:
                x, y = sheet.at(*disc.at)
                yield f'<circle cx="{x}" cy="{y}" r="{number(disc.radius * sheet.scale)}"/>'
        yield "</g>"


def _numbers(sheet: _Sheet) -> Iterator[str]:
    longest = max((len(str(disc.number)) for disc in sheet.picture.discs), default=1)
    least = 0.5 * ROOM * _DIGIT * longest
    yield '<g class="number">'
    for disc in sheet.picture.discs:
        x, y = sheet.at(*disc.at)
        if disc.room * sheet.scale >= least:
            yield f'<text x="{x}" y="{y}">{disc.number}</text>'
    yield "</g>"


def _arrows(sheet: _Sheet) -> Iterator[str]:
    time = sheet.picture.arrow_time
    yield '<g class="velocity">'
    for disc in sheet.picture.discs:
        if any(disc.velocity):
            vx, vy = disc.velocity
            (a, b), tip = sheet.at(*disc.at), sheet.at(*position_after(Plan(*disc.at, vx, vy), time))
            yield f'<path d="M{a} {b}L{" ".join(tip)}"/>'
    yield "</g>"


def _legend(sheet: _Sheet, names: list[str], velocities: bool) -> tuple[list[str], int]:
    """Returns the text below the caption, and its number of lines: a swatch and a word for each colour
    of bodies and each role, and the arrow of a round speed."""
    square = '<rect x="{x}" y="{top}" width="18" height="10"/>'
    filled = '<rect x="{{x}}" y="{{top}}" width="18" height="10" fill="{}"/>'
    signs = [("disc", word, 18.0, filled.format(colour)) for word, colour in sheet.picture.colours]
    signs += [(name if name in LOOKS else "next", name, 18.0, square) for name in names]
    unit = sheet.picture.arrow_time * sheet.scale
    if velocities and unit:
        speed = round_below(40.0 / unit)  # an arrow of 16 to 40 units
        arrow = f'<path d="M{{x}} {{y}}h{number(speed * unit)}"/>'
        signs.append(("velocity", f"speed {speed:g}", speed * unit, arrow))
    found, x, line = [], INSET, 1
    for group, name, length, sign in signs:
        wide = 16.0 + length + _LETTER * len(name)
        if x + wide > INSET + sheet.wide and x > INSET:
            x, line = INSET, line + 1
        y = sheet.tall + 2 * INSET + LINE_HEIGHT * (line + 0.6)
        swatch = sign.format(x=number(x), y=number(y - 4), top=number(y - 9))
        text = f'<text x="{number(x + length + 6)}" y="{number(y)}">{escape(name)}</text>'
        found.append(f'<g class="{group}">{swatch}</g>{text}')
        x += wide
    return found, line if signs else 0


def _style(roles: Iterable[str]) -> str:
    rules = [
        "text{font:12px system-ui,sans-serif}",
        ".number text{fill:#000;text-anchor:middle;dominant-baseline:central}",
        ".disc{stroke-width:1}.arena{fill:none;stroke-width:1.5}.velocity{fill:none;stroke-width:1.2}",
        ".velocity path{marker-end:url(#head)}",
    ]
    for name, look in [*((role, LOOKS[role]) for role in roles), ("next", NEXT_LOOK)]:
        dashes = f";stroke-dasharray:{' '.join(map(number, look.dashes))}" if look.dashes else ""
        dashes += f";stroke-opacity:{number(look.strength)}" if look.strength < 1.0 else ""
        rules.append(
            f".{name}{{fill:{look.colour};fill-opacity:{number(look.filled)};stroke:{look.colour};"
            f"stroke-width:{number(look.width)}{dashes}}}"
        )
    return "".join([*rules, *paper_rules()])


def paper_rules() -> Iterator[str]:
    """Yields the rules of a style sheet that differ in a light and a dark colour scheme."""
    yield from _paper(LIGHT)
    yield f"@media(prefers-color-scheme:dark){{{''.join(_paper(DARK))}}}"


def _paper(paper: Paper) -> Iterator[str]:
    yield f".back{{fill:{paper.back}}}text{{fill:{paper.ink}}}.arena,.velocity{{stroke:{paper.ink}}}"
    yield f".disc{{stroke:{paper.edge}}}"
