"""The first picture of README: two panes on one clock, ``python bullet.py bullet.svg`` in this folder.

Both play ``docs/scenes/bullet.toml``. On the left all bodies move by a sixtieth of a second, then pairs
of discs that overlap bounce: nothing is computed between two. On the right are the contacts of kinetile;
a body has one value at each of its own events, and the browser interpolates between them. Readers whose
system asks for less motion see the end.
"""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import NamedTuple

import kinetile as kt
from kinetile.show.picture import DARK, KINDS, LIGHT, NEXT_LOOK

SCENE = Path(__file__).parents[1] / "scenes" / "bullet.toml"
RATE = 60
"""Frames a second of the left pane."""

UNTIL = 0.125
"""The end of the scene."""

SECONDS, HOLD = 10.0, 0.2
"""How long the picture plays, and the part of it at the end in which it stands."""

ROOM = (4.5, 2.2)
"""What of the scene is shown, from its origin."""

SCALE, GAP, HEAD = 104.0, 24.0, 44.0
"""Units of the file for a metre, between the panes, and above them."""

WIDTH, HEIGHT = ROOM[0] * SCALE, ROOM[1] * SCALE
CLOCK = HEIGHT + 22.0
BLUE, ORANGE, *_ = KINDS

BEHIND_WALL, BEFORE_WALL, ABOVE_DISCS = (2.75, 1.85), (0.15, 1.85), (0.15, 0.92)
"""The places of the texts in the scene."""

Track = list[tuple[float, float, float]]


class Pane(NamedTuple):
    """Content of a pane: (time, x, y) of each body, texts with their times and places, and marks as SVG."""

    title: str
    tracks: list[Track]
    said: list[tuple[float, str, float, float]]
    marks: list[tuple[float, float, str]]  # from, until
    jumps: bool


def n(value: float) -> str:
    """Return a number with as many digits as the picture needs."""
    return f"{value:.1f}".removesuffix(".0")


def at(x: float, y: float) -> tuple[str, str]:
    """Return where a place of the scene is in a pane."""
    return n(x * SCALE), n(HEIGHT - y * SCALE)


def stepped(scene: kt.Scene) -> Pane:
    """Play a scene in steps: move all, then let pairs that overlap and approach bounce."""
    place, velocity = scene.position.copy(), scene.velocity.copy()
    tracks: list[Track] = [[(0.0, *spot)] for spot in place.tolist()]
    said, marks = [], []
    bullet, plate, left, right = range(4)
    frames = int(UNTIL * RATE)
    for frame in range(1, frames + 1):
        before, now = place[bullet, 0], frame / RATE
        place += velocity / RATE
        if before < place[plate, 0] < place[bullet, 0]:
            (x, y), (to_x, _) = at(*tracks[bullet][-1][1:]), at(*place[bullet])
            said.append((now, "missed", *BEHIND_WALL))
            marks.append((now, UNTIL, f'<path class="wrong way" d="M{x} {y}H{to_x}"/>'))
        reach = float(scene.radius[left])
        apart = place[right, 0] - place[left, 0]
        if apart < 2 * reach and velocity[left, 0] > velocity[right, 0]:
            said.append((now, f"{2 * reach - apart:.2f} m too deep", *ABOVE_DISCS))
            high = math.sqrt(reach**2 - apart**2 / 4)
            x, y = at(place[left, 0] + apart / 2, place[left, 1] + high)
            _, low = at(0.0, place[left, 1] - high)
            r = n(reach * SCALE)
            lens = f'<path class="wrong" d="M{x} {y}A{r} {r} 0 0 1 {x} {low}A{r} {r} 0 0 1 {x} {y}Z"/>'
            marks.append((now, now + 1 / RATE, lens))
            velocity[[left, right]] = velocity[[right, left]]  # of one mass, head on
        for track, spot in zip(tracks, place.tolist(), strict=True):
            track.append((now, *spot))
    return Pane(f"steps of 1/{RATE} s", tracks, said, marks, True)


def exact(scene: kt.Scene) -> Pane:
    """Play a scene under kinetile: each body at its start, its contacts and the end."""
    sim = kt.Simulation(scene)
    tracks: list[Track] = [[(0.0, *spot)] for spot in sim.positions().tolist()]
    said, marks = [], []
    words = {("bullet", "plate"): ("hit", BEFORE_WALL), ("ball", "ball"): ("bounce", ABOVE_DISCS)}
    for event in sim.steps(UNTIL):
        if len(event.bodies) == 2:
            first, second = event.bodies
            spots = sim.positions().tolist()
            for body in event.bodies:
                tracks[body].append((event.time, *spots[body]))
            x = spots[first][0] + (float(scene.radius[first]) if first else 0.04)
            cx, cy = at(x, spots[first][1])
            word, place = words[sim.kinds[first], sim.kinds[second]]
            said.append((event.time, f"{word} at {event.time:.3g} s", *place))
            ring = f'<circle class="right" cx="{cx}" cy="{cy}" r="9"/>'
            tick = f'<path class="right" d="M{n(event.time / UNTIL * WIDTH)} {n(CLOCK - 12)}v24"/>'
            marks.append((event.time, UNTIL, ring + tick))
    for track, spot in zip(tracks, sim.positions().tolist(), strict=True):
        track.append((UNTIL, *spot))
    return Pane("kinetile", tracks, said, marks, False)


def key(time: float) -> str:
    """Return a time of the scene as a part of the picture's time."""
    return f"{min(time / UNTIL, 1.0) * (1.0 - HOLD):.4f}".rstrip("0").rstrip(".")


def animate(name: str, frames: list[tuple[float, str]], jumps: bool) -> str:
    """Return an animation of an attribute through values at times of the scene."""
    frames = [*frames, (UNTIL / (1.0 - HOLD), frames[-1][1])]
    times = ";".join([*(key(time) for time, _ in frames[:-1]), "1"])
    values = ";".join(value for _, value in frames)
    mode = ' calcMode="discrete"' if jumps else ""
    return (
        f'<animate attributeName="{name}" dur="{SECONDS:g}s" repeatCount="indefinite"{mode} '
        f'keyTimes="{times}" values="{values}"/>'
    )


def shown(begin: float, end: float) -> str:
    """Return the animation of what is there between two times alone, or from one on."""
    frames = [(0.0, "0"), (begin, "1"), *([(end, "0")] if end < UNTIL else [])]
    return animate("opacity", frames, True)


def drawn(pane: Pane, scene: kt.Scene, plays: bool) -> list[str]:
    """Return a pane as SVG, with its animations or as it is in the end."""
    lines = []
    lines.append(f'<rect class="room" width="{n(WIDTH)}" height="{n(HEIGHT)}"/>')
    for body, track in enumerate(pane.tracks):
        points = [(time, *at(x, y)) for time, x, y in track]
        _, x, y = points[-1]
        if scene.velocity[body].any():
            moves = animate("cx", [(time, cx) for time, cx, _ in points], pane.jumps) if plays else ""
            r = n(float(scene.radius[body]) * SCALE)
            if pane.jumps and body == 0:  # where the bullet was in the frames before
                lines += [
                    f'<circle class="was" cx="{cx}" cy="{cy}" r="{r}">'
                    f"{shown(time, UNTIL) if plays else ''}</circle>"
                    for time, cx, cy in points
                ]
            kind = "bullet" if body == 0 else "disc"
            lines.append(f'<circle class="{kind}" cx="{x}" cy="{y}" r="{r}">{moves}</circle>')
        else:
            left, top = at(*(scene.position[body] + [-0.025, 0.55]))
            lines.append(f'<rect class="plate" x="{left}" y="{top}" width="5.2" height="{n(1.1 * SCALE)}"/>')
    for begin, end, mark in pane.marks:
        if plays or end == UNTIL:
            lines.append(f"<g>{shown(begin, end) if plays else ''}{mark}</g>")
    ticks = "".join(f"M{n(frame / RATE / UNTIL * WIDTH)} {n(CLOCK - 7)}v14" for frame in range(8))
    lines.append(f'<path class="clock" d="M0 {n(CLOCK)}H{n(WIDTH)}{ticks}"/>')
    frames = [(k / RATE, n(k / RATE / UNTIL * WIDTH)) for k in range(int(UNTIL * RATE) + 1)]
    frames = frames if pane.jumps else [(0.0, "0"), (UNTIL, n(WIDTH))]
    hand = animate("cx", frames, pane.jumps) if plays else ""
    lines.append(f'<circle class="hand" cx="{frames[-1][1]}" cy="{n(CLOCK)}" r="7">{hand}</circle>')
    look = "no" if pane.jumps else "yes"
    for time, text, *place in pane.said:
        x, y = at(*place)
        appears = shown(time, UNTIL) if plays else ""
        lines.append(f'<text class="{look}" x="{x}" y="{y}">{appears}{text}</text>')
    return lines


def picture() -> str:
    """Return the whole file."""
    scene = kt.load_scene(SCENE)
    panes = [stepped(scene), exact(scene)]
    width, height = n(2 * WIDTH + GAP + 12), n(HEAD + HEIGHT + 40)
    style = (
        "text{font:27px system-ui,sans-serif}.still{display:none}"
        "@media(prefers-reduced-motion:reduce){.still{display:inline}.plays{display:none}}"
        f".room,.clock{{fill:none;stroke-width:1.5}}.hand{{stroke:none}}"
        f".wrong{{fill:{NEXT_LOOK.colour};stroke:{NEXT_LOOK.colour};stroke-width:3}}"
        f".way{{stroke-dasharray:8 5}}"
        f".right{{fill:none;stroke:{BLUE};stroke-width:3}}.was{{fill-opacity:.5}}"
    )
    papers = [
        f".back{{fill:{paper.back}}}.room,.clock{{stroke:{paper.edge}}}.disc{{fill:{BLUE};"
        f"stroke:{paper.edge};stroke-width:1.5}}text,.plate,.hand{{fill:{paper.ink}}}.bullet,.was{{fill:{ORANGE}}}"
        f".no{{fill:{no}}}.yes{{fill:{yes}}}"
        for paper, no, yes in ((LIGHT, "#B04A00", BLUE), (DARK, "#FF9A57", "#7CC4F2"))
    ]
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" role="img">',
        "<title>In steps a bullet passes through a wall and two discs overlap; under kinetile it stops at "
        "the wall, and they bounce</title>",
        f"<style>{style}{papers[0]}@media(prefers-color-scheme:dark){{{papers[1]}}}</style>",
        f'<rect class="back" width="{width}" height="{height}"/>',
    ]
    for place, pane in enumerate(panes):
        lines.append(f'<g transform="translate({n(4 + place * (WIDTH + GAP))} {n(HEAD)})">')
        lines.append(f'<text y="-14">{pane.title}</text>')
        for name in ("plays", "still"):
            lines += [f'<g class="{name}">', *drawn(pane, scene, name == "plays"), "</g>"]
        lines.append("</g>")
    return "\n".join([*lines, "</svg>", ""])


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(picture(), encoding="utf-8")
