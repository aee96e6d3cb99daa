"""The moving picture of README: a run under sweep-tiling, as an SVG that any browser plays.

Nothing is sampled. A disc flies straight from contact to contact, and the corners of a tile move with the
discs that they hang on. So each has one value at each of its own events, and what the browser interpolates
between them is what the kernel computes. ``python moving.py moving.svg`` in this folder writes it again.
"""

from __future__ import annotations

import sys
from bisect import bisect_left
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

import kinetile as kt
from kinetile.plugin.drawing import At, Box, Coordinate
from kinetile.show.picture import DARK, KINDS, LIGHT, LOOKS, NEXT_LOOK

UNTIL = 0.16
"""The end of the run, in the scene's time."""

SECONDS = 16
"""How long the picture plays."""

SIZE, MARGIN = 480.0, 6.0
"""The arena's side and the margin around it, in units of the file."""

FLASH = 0.004
"""How long a contact is marked, in the scene's time."""

Corners = tuple[tuple[Coordinate, Coordinate], tuple[Coordinate, Coordinate]]


class Life(NamedTuple):
    """A tile, by its lower left and upper right corner, and how long it exists, or is the next to fail."""

    corners: Corners
    born: float
    gone: float


class Recording:
    """A run, read event by event: where discs turn, which tiles exist when, and which one fails next."""

    def __init__(self, sim: kt.Simulation) -> None:
        self.flights = [[(sim.time, tuple(place))] for place in sim.positions().tolist()]
        self.contacts: list[tuple[float, int, int]] = []
        self.tiles: list[Life] = []
        self.next: list[Life] = []
        alive: dict[Corners, float] = {}
        first: tuple[Corners, float] | None = None
        ended = False
        steps = sim.steps(UNTIL)
        while not ended:
            now, boxes = sim.time, [each for each in sim.drawing() if isinstance(each, Box)]
            found = {(box.low, box.high): box.fails for box in boxes if box.role == "tile"}
            self.tiles += [Life(each, alive.pop(each), now) for each in [*alive] if each not in found]
            alive = {each: alive.get(each, now) for each in found}
            failing = min((fails, each) for each, fails in found.items() if fails is not None)[1]
            if first is None or first[0] != failing:
                self.next += [Life(*first, now)] if first else []
                first = failing, now
            event = next(steps, None)
            ended = event is None
            turned = range(len(self.flights)) if event is None else event.bodies
            for body in turned:
                self.flights[body].append((sim.time, tuple(sim.positions()[body].tolist())))
            if event is not None and event.kind == "disc":
                a, b = event.bodies
                self.contacts.append((event.time, a, b))
        assert first is not None
        self.tiles += [Life(each, born, UNTIL) for each, born in alive.items()]
        self.next.append(Life(*first, UNTIL))

    def place(self, body: int, time: float) -> tuple[float, float]:
        """Return where a body is at a time."""
        flight = self.flights[body]
        after = max(bisect_left(flight, time, key=lambda each: each[0]), 1)
        (begin, (x, y)), (end, (to_x, to_y)) = flight[after - 1], flight[after]
        share = (time - begin) / (end - begin) if end > begin else 0.0
        return x + share * (to_x - x), y + share * (to_y - y)

    def coordinate(self, value: Coordinate, axis: int, time: float) -> float:
        """Return a coordinate of a shape at a time; one that hangs on a body moves with it."""
        return self.place(value.body, time)[axis] + value.offset if isinstance(value, At) else value

    def moments(self, life: Life) -> list[float]:
        """Return when a tile begins, when discs that it hangs on turn, and when it ends."""
        bodies = {each.body for corner in life.corners for each in corner if isinstance(each, At)}
        turns = {time for body in bodies for time, _ in self.flights[body]}
        return [life.born, *sorted(each for each in turns if life.born < each < life.gone), life.gone]

    def outline(self, life: Life, time: float) -> str:
        """Return the corners of a tile at a time, as the points of a polygon."""
        (left, low), (right, high) = (
            [self.coordinate(value, axis, time) for axis, value in enumerate(corner)]
            for corner in life.corners
        )
        right, high = max(left, right), max(low, high)
        return " ".join(_point(x, y) for x, y in ((left, low), (right, low), (right, high), (left, high)))


def _n(value: float) -> str:
    return f"{value:.1f}".removesuffix(".0")


def _point(x: float, y: float) -> str:
    return f"{_n(MARGIN + x * SIZE)},{_n(MARGIN + (1.0 - y) * SIZE)}"


def _animate(attribute: str, frames: Iterable[tuple[float, str]]) -> str:
    """Return an animation through values of an attribute at times of the run, over and over."""
    times, values = zip(*frames, strict=True)
    keys = ";".join(f"{time / UNTIL:.4f}".rstrip("0").rstrip(".") for time in times)
    return (
        f'<animate attributeName="{attribute}" dur="{SECONDS}s" repeatCount="indefinite" '
        f'keyTimes="{keys}" values="{";".join(values)}"/>'
    )


def _polygon(recording: Recording, lives: Iterable[Life]) -> str:
    """Return one polygon that is several tiles, one after the other; between two it has no area."""
    frames: list[tuple[float, str]] = []
    for life in lives:
        before = frames[-1][0] if frames else 0.0
        if life.born > before:
            frames += [(before, "0,0 0,0 0,0 0,0"), (life.born, "0,0 0,0 0,0 0,0")]
        frames += [(time, recording.outline(life, time)) for time in recording.moments(life)]
    if frames[-1][0] < UNTIL:
        frames += [(frames[-1][0], "0,0 0,0 0,0 0,0"), (UNTIL, "0,0 0,0 0,0 0,0")]
    return f'<polygon points="{frames[0][1]}">{_animate("points", frames)}</polygon>'


def _polygons(recording: Recording) -> Iterator[str]:
    """Yield as many polygons as there are tiles at one time."""
    slots: list[list[Life]] = []
    for life in sorted(recording.tiles, key=lambda each: (each.born, each.gone)):
        slot = next((slot for slot in slots if slot[-1].gone <= life.born), None)
        if slot is None:
            slots.append(slot := [])
        slot.append(life)
    yield from (_polygon(recording, slot) for slot in slots)


def _discs(recording: Recording, radii: list[float]) -> Iterator[str]:
    for flight, radius in zip(recording.flights, radii, strict=True):
        times = [time for time, _ in flight]
        across, down = zip(*(_point(*place).split(",") for _, place in flight), strict=True)
        moving = _animate("cx", zip(times, across, strict=True)) + _animate(
            "cy", zip(times, down, strict=True)
        )
        yield f'<circle cx="{across[0]}" cy="{down[0]}" r="{_n(radius * SIZE)}">{moving}</circle>'


def _flashes(recording: Recording, radii: list[float]) -> Iterator[str]:
    """Yield a ring at the place of each contact of two discs, which opens and vanishes."""
    for time, a, b in recording.contacts:
        (x, y), (to_x, to_y) = recording.place(a, time), recording.place(b, time)
        share = radii[a] / (radii[a] + radii[b])
        cx, cy = _point(x + share * (to_x - x), y + share * (to_y - y)).split(",")
        end = min(time + FLASH, UNTIL)
        ring = _animate("r", [(0.0, "0"), (time, "0"), (time, "2"), (end, "14"), (end, "0"), (UNTIL, "0")])
        yield f'<circle cx="{cx}" cy="{cy}" r="0">{ring}</circle>'


def moving_picture() -> str:
    """Return the whole file."""
    scene = kt.make_scene("random", bodies=24, density=0.3, radius_ratio=4, seed=4)
    sim = kt.Simulation(scene, "sweep-tiling")
    radii = sim.radii().tolist()
    recording = Recording(sim)
    whole = _n(SIZE + 2 * MARGIN)
    tile = LOOKS["tile"]
    style = (
        f".tile{{fill:{tile.colour};fill-opacity:{tile.filled};stroke:{tile.colour};stroke-width:1}}"
        f".next{{fill:{NEXT_LOOK.colour};fill-opacity:.55;stroke:{NEXT_LOOK.colour};stroke-width:3}}"
        f".ring{{fill:none;stroke:{NEXT_LOOK.colour};stroke-width:2}}.arena{{fill:none;stroke-width:1.5}}"
    )
    papers = [
        f".back{{fill:{paper.back}}}.arena{{stroke:{paper.ink}}}.disc{{fill:{KINDS[0]};stroke:{paper.edge}}}"
        for paper in (LIGHT, DARK)
    ]
    fade = _animate("opacity", [(0.0, "0"), (0.02 * UNTIL, "1"), (0.98 * UNTIL, "1"), (UNTIL, "0")])
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {whole} {whole}" role="img">',
        f"<title>sweep-tiling: {len(scene)} discs, tiles between them; orange: what fails next</title>",
        f"<style>{style}{papers[0]}@media(prefers-color-scheme:dark){{{papers[1]}}}</style>",
        f'<rect class="back" width="{whole}" height="{whole}"/>',
        f"<g>{fade}",
        '<g class="tile">',
        *_polygons(recording),
        '</g><g class="next">',
        _polygon(recording, recording.next),
        '</g><g class="disc">',
        *_discs(recording, radii),
        '</g><g class="ring">',
        *_flashes(recording, radii),
        "</g></g>",
        f'<rect class="arena" x="{_n(MARGIN)}" y="{_n(MARGIN)}" width="{_n(SIZE)}" height="{_n(SIZE)}"/>',
        "</svg>",
        "",
    ]
    return "\n".join(lines)


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(moving_picture(), encoding="utf-8")
