"""Diagrams of the documents, and charts of the numbers in their tables: SVG in light and dark colours.

To draw them again: ``python diagrams.py .``. A chart is drawn from the table of the page on which it stands,
so the two cannot differ; ``tests/test_figures.py`` compares the files with what this draws.
"""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Iterator
from html import escape
from pathlib import Path

DOCS = Path(__file__).parents[1]

STYLE = (
    ".back{fill:#fff}text{font:14px system-ui,sans-serif;fill:#000;text-anchor:middle}.small{font-size:12px}"
    ".left{text-anchor:start}.right{text-anchor:end}.box{fill:#e6e6e6;stroke:#404040}.line{fill:none;stroke:#000}"
    "marker path{fill:#000}.grid{stroke:#ddd}.plugin{fill:#56B4E9;fill-opacity:.3;stroke:#0072B2}"
    ".mark{fill:#D55E00;fill-opacity:.4;stroke:#D55E00;stroke-width:1.5}.curve{fill:none;stroke-width:2}"
    "@media(prefers-color-scheme:dark){.back{fill:#14181d}text,marker path{fill:#f0f0f0}.line{stroke:#f0f0f0}"
    ".box{fill:#39424c;stroke:#c0c6cc}.grid{stroke:#333}}"
)

SERIES = {
    "naive": ("#A3437A", "#CC79A7", "4 4", "M-4-4h8v8h-8z"),
    "cells": ("#00795A", "#2FC79B", "", "M-4 0a4 4 0 1 0 8 0a4 4 0 1 0-8 0z"),
    "sap-1d": ("#0072B2", "#56B4E9", "10 4", "M0-5L5 4H-5z"),
    "sap-2d": ("#666666", "#A8A8A8", "2 3", "M0 5L5-4H-5z"),
    "sap-k": ("#5A3FC0", "#A994F5", "6 2", "M-1.5-5h3v3.5h3.5v3h-3.5v3.5h-3v-3.5h-3.5v-3h3.5z"),
    "sweep-tiling": ("#B84A00", "#F08A40", "10 3 2 3", "M0-5.5L5.5 0L0 5.5L-5.5 0z"),
    "power": ("#7A5C00", "#E0B93D", "14 3", "M-5 0L-2.5-4.5H2.5L5 0L2.5 4.5H-2.5z"),
}
"""Of each phase in a chart its colours on light and on dark, its dashes and its marker."""

HEAD = (
    '<marker id="head" viewBox="0 0 8 8" refX="8" refY="4" markerWidth="8" markerHeight="8" orient="auto">'
    '<path d="M0 0L8 4L0 8z"/></marker>'
)

LINE = 18
"""Pixels from a line of text to the next."""


def picture(width: int, height: int, title: str, *parts: str) -> str:
    """Return a whole SVG."""
    body = "\n".join(parts)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" '
        f'height="{height}" role="img">\n<title>{escape(title)}</title>\n<style>{STYLE}</style>\n{HEAD}\n'
        f'<rect class="back" width="{width}" height="{height}"/>\n{body}\n</svg>\n'
    )


def text(x: float, y: float, words: str, kind: str = "") -> str:
    """Return a line of text; ``y`` is its middle."""
    return f'<text class="{kind}" x="{x:g}" y="{y + 5:g}">{escape(words)}</text>'


def box(x: int, y: int, width: int, *lines: str, kind: str = "box") -> str:
    """Return a box with lines of text in its middle."""
    height = LINE * len(lines) + 14
    rect = f'<rect class="{kind}" x="{x}" y="{y}" width="{width}" height="{height}" rx="5"/>'
    return rect + "".join(text(x + width / 2, y + 16 + LINE * at, line) for at, line in enumerate(lines))


def arrow(
    *points: tuple[float, float], label: str = "", at: tuple[float, float] = (0, 0), kind: str = ""
) -> str:
    """Return an arrow through some points, with a label at a place."""
    path = " ".join(f"{x:g},{y:g}" for x, y in points)
    drawn = f'<polyline class="line" points="{path}" marker-end="url(#head)"/>'
    return drawn + (text(*at, label, f"small {kind}") if label else "")


def kernel() -> str:
    """Return the loop of the kernel: what happens at the head of the queue."""
    return picture(
        720,
        400,
        "The loop of the kernel",
        box(20, 140, 150, "queue", "one entry a body:", "own, tick, wall"),
        box(250, 20, 200, "its own certificate fails"),
        box(250, 104, 200, "a guess (a lower bound)"),
        box(250, 188, 200, "contact: pair or wall"),
        box(250, 256, 200, "command"),
        box(520, 11, 180, "repair:", "the newcomers", kind="plugin"),
        box(520, 95, 180, "meet:", "the exact tick", kind="plugin"),
        box(520, 188, 180, "new flight plans"),
        box(520, 256, 180, "near: candidates", kind="plugin"),
        box(520, 324, 180, "soonest: bounds", kind="plugin"),
        *(arrow((170, 173), (210, 173), (210, y), (250, y)) for y in (36, 120, 204, 272)),
        text(180, 122, "the head", "small"),
        arrow((450, 36), (520, 36)),
        arrow((450, 120), (520, 120)),
        arrow((450, 204), (520, 204)),
        arrow((450, 272), (485, 272), (485, 212), (520, 212)),
        arrow((610, 220), (610, 256), label="predict", at=(618, 238), kind="left"),
        arrow((610, 288), (610, 324)),
        arrow((700, 36), (711, 36), (711, 340), (700, 340)),
        arrow((520, 340), (95, 340), (95, 208), label="the entry is filed", at=(300, 330)),
        arrow((520, 128), (500, 128), (500, 340)),
        text(20, 386, "blue: hooks of a broad phase or of a narrow phase", "small left"),
    )


def hooks() -> str:
    """Return what the kernel calls a broad phase for, and what the hooks leave."""
    rows = (
        ("the start; built again", "arrange, then build", "the structure; schedule for each body"),
        ("a certificate fails", "repair", "schedule; newcomers in k.near"),
        ("the plan of a body changes", "replan", "schedule"),
        ("contacts are predicted", "near", "all candidates in k.near"),
        ("a body comes or goes", "enter, leave", "the structure; schedule; offer"),
    )
    parts = [text(x, 18, head, "small") for x, head in ((115, "kernel"), (324, "hook"), (563, "result"))]
    for at, (event, hook, result) in enumerate(rows):
        y = 34 + 46 * at
        parts += [box(5, y, 220, event), box(246, y, 156, hook, kind="plugin"), box(423, y, 292, result)]
        parts += [arrow((225, y + 16), (246, y + 16)), arrow((402, y + 16), (423, y + 16))]
    return picture(720, 34 + 46 * len(rows), "Which hook is called when, and what it leaves", *parts)


def stages() -> str:
    """Return the three stages of an exact tick."""
    names = (
        ("filter", "one Newton step, and", "a bound of its error"),
        ("closer look", "the sign of q at whole", "ticks, up to 8 steps"),
        ("integers", "of any size,", "without rounding"),
    )
    parts = []
    for at, lines in enumerate(names):
        x = 10 + 260 * at
        parts.append(box(x, 20, 180, *lines))
        parts.append(arrow((x + 90, 88), (x + 90, 126), label="decides", at=(x + 98, 106), kind="left"))
        if at < 2:
            parts.append(arrow((x + 180, 54), (x + 260, 54), label="undecided", at=(x + 220, 42)))
    return picture(720, 168, "Three stages", *parts, box(10, 126, 700, "the tick of the contact, or never"))


def rule() -> str:
    """Return rule 5 of the specification: the tick of a contact is the floor of the first root."""
    left, top, base, tick = 60, 20, 150, 75
    first, second = 3.4, 7.0  # the roots, in ticks
    gap = [(t / 20, (t / 20 - first) * (t / 20 - second) * 9) for t in range(8, 161)]
    curve = " ".join(f"{left + tick * t:.1f},{base - value:.1f}" for t, value in gap if base - value > top)
    parts = [
        f'<line class="grid" x1="{left + tick * t}" x2="{left + tick * t}" y1="{top}" y2="200"/>'
        for t in range(9)
    ]
    parts += [text(left + tick * t, 214, f"s + {t}" if t else "s", "small") for t in range(9)]
    parts.append(f'<polyline class="curve" stroke="#0072B2" points="{curve}"/>')
    root, floor = left + tick * first, left + tick * math.floor(first)
    parts += [arrow((left, base), (left + 8.3 * tick, base)), text(left - 30, base, "Q = 0", "small")]
    parts.append(f'<circle class="mark" cx="{root:g}" cy="{base}" r="5"/>')
    parts.append(text(root + 12, base - 14, "T₁: the discs touch", "left"))
    parts.append(
        arrow((root, base + 8), (root, 184), (floor + 2, 184), label="floor", at=(root + 8, 184), kind="left")
    )
    parts.append(text(left + 8.1 * tick, base - 55, "Q(T)", "left"))
    parts.append(text(floor, 234, "the tick of contact"))
    return picture(720, 250, "Rule 5: the squared gap Q over the tick T", *parts)


def study() -> str:
    """Return how a study goes from a file to a table, with the numbers of its page's example."""
    return picture(
        720,
        150,
        "From the file of a study to its table",
        box(10, 24, 160, "growth.toml", "6 scenes, 2 phases,", "4 seeds"),
        box(210, 33, 110, "48 tasks", "no row yet"),
        box(360, 15, 130, "worker"),
        box(360, 67, 130, "worker"),
        box(530, 24, 180, "growth.sqlite", "a row for each task,", "errors included", kind="plugin"),
        arrow((170, 58), (210, 58)),
        arrow((320, 58), (340, 58), (340, 31), (360, 31)),
        arrow((320, 58), (340, 58), (340, 83), (360, 83)),
        arrow((490, 31), (510, 31), (510, 50), (530, 50)),
        arrow((490, 83), (510, 83), (510, 66), (530, 66)),
        arrow((620, 92), (620, 135), (265, 135), (265, 83)),
        text(440, 125, "started again: tasks with a row are left out", "small"),
    )


def table(page: str, heading: str) -> Iterator[list[str]]:
    """Yield the rows of the first table under a heading of a page, the head first."""
    section = (DOCS / page).read_text(encoding="utf-8").split(f"\n## {heading}\n")[1].split("\n## ")[0]
    for row in re.findall(r"^\|(.*)\|$", section, re.MULTILINE):
        if not re.fullmatch(r"[-| ]+", row):
            yield [cell.strip(" `") for cell in row.split("|")]


def chart(title: str, across: str, curves: dict[str, list[tuple[float, float]]]) -> str:
    """Return curves of thousand contacts a CPU second, both axes logarithmic."""
    left, right, top, bottom = 60, 600, 24, 280
    points = [point for curve in curves.values() for point in curve]
    (x0, x1), (y0, y1) = (
        (math.log10(min(each)), math.log10(max(each))) for each in zip(*points, strict=True)
    )
    lines = [k * 10**power for power in range(6) for k in (1, 2, 5)]
    y0 = math.log10(max(each for each in lines if math.log10(each) <= y0))
    y1 = math.log10(min(each for each in lines if math.log10(each) >= y1))

    def place(x: float, y: float) -> tuple[float, float]:
        along, up = (math.log10(x) - x0) / (x1 - x0), (math.log10(y) - y0) / (y1 - y0)
        return left + (right - left) * along, bottom - (bottom - top) * up

    parts = [text(left, 10, "thousand contacts a CPU second", "small left")]
    for line in lines:
        if y0 <= math.log10(line) <= y1:
            y = place(points[0][0], line)[1]
            parts.append(f'<line class="grid" x1="{left}" x2="{right}" y1="{y:.1f}" y2="{y:.1f}"/>')
            parts.append(text(left - 8, round(y, 1), f"{line:,}", "small right"))
    for x in sorted({x for x, _ in points}):
        words = f"{x:,.0f}" if x >= 1 else f"{x:g}"
        parts.append(text(round(place(x, 10.0**y0)[0], 1), bottom + 16, words, "small"))
    parts.append(text((left + right) / 2, bottom + 36, across, "small"))
    rules = [".series text,.series path{fill:currentColor}"]
    rules.append(".series .curve,.series .line{fill:none;stroke:currentColor}")
    ends = {name: place(*max(curve))[1] for name, curve in curves.items()}
    for name, named_at in apart(ends).items():
        light, dark, dashes, marker = SERIES[name]
        rules.append(f".{name}{{color:{light}}}@media(prefers-color-scheme:dark){{.{name}{{color:{dark}}}}}")
        places = [place(*point) for point in sorted(curves[name])]
        path = " ".join(f"{x:.1f},{y:.1f}" for x, y in places)
        marks = "".join(f'<path transform="translate({x:.1f} {y:.1f})" d="{marker}"/>' for x, y in places)
        end, height = places[-1]
        parts += [
            f'<g class="series {name}"><polyline class="curve" stroke-dasharray="{dashes}" points="{path}"/>',
            f'{marks}<path class="line" d="M{end + 6:.1f} {height:.1f}L{end + 20:.1f} {named_at:.1f}"/>',
            f"{text(round(end + 24, 1), round(named_at, 1), name, 'left')}</g>",
        ]
    return picture(720, bottom + 52, title, f"<style>{''.join(rules)}</style>", *parts)


def apart(ends: dict[str, float]) -> dict[str, float]:
    """Return the heights of names beside the ends of their curves, a line apart: those that would overlap
    are spread around the middle of their ends, in the order of these."""
    groups: list[list[str]] = []
    spread: dict[str, float] = {}
    for name in sorted(ends, key=lambda name: ends[name]):
        groups.append([name])
        while True:
            middle = sum(ends[each] for each in groups[-1]) / len(groups[-1])
            first = middle - LINE * (len(groups[-1]) - 1) / 2
            if len(groups) < 2 or first >= spread[groups[-2][-1]] + LINE:
                break
            groups[-2:] = [groups[-2] + groups[-1]]
        spread |= {each: first + LINE * at for at, each in enumerate(groups[-1])}
    return spread


def densities() -> str:
    """Return contacts a second of each phase over the density."""
    (_, *names), *rows = table("which-broad-phase.md", "Contacts a second")
    curves = {
        name: [(float(row[0]), float(row[at].split(",")[1])) for row in rows]
        for at, name in enumerate(names, 1)
    }
    return chart("Contacts a second over the density, 400 discs", "density", curves)


def growth() -> str:
    """Return contacts a second of ``cells`` over the number of discs."""
    _, *rows = table("which-broad-phase.md", "Growth")
    curve = [(float(row[0].replace(",", "")), float(row[1].replace(",", ""))) for row in rows]
    return chart("Contacts a second over the number of discs", "discs", {"cells": curve})


DIAGRAMS = {
    "kernel.svg": kernel,
    "hooks.svg": hooks,
    "stages.svg": stages,
    "rule-5.svg": rule,
    "study.svg": study,
    "densities.svg": densities,
    "growth.svg": growth,
}


def main(folder: Path) -> None:
    """Draw all of them into a folder."""
    for name, draw in DIAGRAMS.items():
        (folder / name).write_text(draw(), encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
