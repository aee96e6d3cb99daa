"""HTML of a scene, a simulation, readings and estimates: a table, and the picture of the moment beside it.

Above ``MOST_STRUCTURE`` bodies the structure is left out, as is a structure of more than ``MOST_SHAPES``
shapes or one that is not built yet; above ``MOST_BODIES`` there is no picture. A display changes nothing,
compiles nothing and raises nothing: it names the omitted parts and the errors that happened. All text is
escaped; styles are in the tags and name no colour, for dark pages.
"""

import math
from base64 import b64encode
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence

from kinetile.errors import BusyError
from kinetile.explanation import reading_lines
from kinetile.plugin.choices import called
from kinetile.run.readings import Readings
from kinetile.run.simulation import Simulation, composition_of
from kinetile.scene import Scene
from kinetile.scene.commands import counted
from kinetile.scene.scene import around, in_words, source_of
from kinetile.show.picture import Picture, escape, picture_of_scene, take_picture
from kinetile.show.svg import as_svg as picture_as_svg
from kinetile.statistics import Observed

MOST_BODIES = 2000
"""The most bodies of a picture."""

MOST_STRUCTURE = 250
"""The most bodies of a picture with their structure."""

MOST_SHAPES = 2000
"""The most shapes of a structure."""

Thing = Scene | Simulation | Readings | Observed


def as_html(thing: Thing) -> str:
    """Returns the notebook display of a scene, a simulation, readings or estimates: a table, and the
    picture of the moment. Raises nothing: the display shows errors."""
    try:
        if isinstance(thing, Readings):
            return facts("Readings", reading_lines(thing.as_dict()))
        if isinstance(thing, Observed):
            return grid("Observed", thing.HEADS, thing.lines(), [1 < place < 5 for place in range(6)])
        picture, left_out = _picture(thing)
        if isinstance(thing, Scene):
            parts = [facts(f"Scene of {in_words(thing, len(thing))}", _scene_lines(thing))]
        else:
            parts = [facts("Simulation", _simulation_lines(thing))]
        if picture is not None:
            parts.append(figure(_svg(thing, picture), f"Picture: {picture.caption}"))
        if left_out:
            parts.append(paragraph(f"{left_out}."))
        return "\n".join(parts)
    except Exception as error:  # a display must not break a notebook's cell
        return paragraph(f"{type(thing).__name__}: cannot be shown: {type(error).__name__}: {error}")


def as_svg(thing: Scene | Simulation) -> str | None:
    """Returns the picture of a scene at its start, or of a simulation now, as SVG; None without one,
    for a reason that ``as_html`` names. Raises nothing."""
    try:
        picture, _ = _picture(thing)
        return None if picture is None else _svg(thing, picture).decode()
    except Exception:  # as_html shows the error
        return None


def _svg(thing: Scene | Simulation, picture: Picture) -> bytes:
    return picture_as_svg(picture, isinstance(thing, Scene) and len(thing) <= MOST_STRUCTURE)


def _picture(thing: Scene | Simulation) -> tuple[Picture | None, str]:
    count = len(thing if isinstance(thing, Scene) else thing.bodies)
    if count > MOST_BODIES:
        return None, f"No picture: more than {MOST_BODIES:,} bodies are not drawn here"
    if isinstance(thing, Scene):
        return picture_of_scene(thing), ""
    bodies = take_picture(thing, structure=False)
    if not all(math.isfinite(x) for disc in bodies.discs for x in disc.at):
        return None, "No picture: a body is at no finite place"
    if count > MOST_STRUCTURE:
        return bodies, f"Without the structure: it is drawn here for up to {MOST_STRUCTURE} bodies"
    if not thing.built:
        return bodies, "Without the structure: it is not built yet; run() or build() does that"
    try:
        whole = take_picture(thing)
    except BusyError as busy:
        return None, f"No picture: {busy}"
    except Exception as error:  # for example in the phase's draw
        return bodies, f"Without the structure: {type(error).__name__}: {error}"
    if len(whole.shapes) > MOST_SHAPES:
        text = f"it has {len(whole.shapes):,} shapes, and up to {MOST_SHAPES:,} are drawn here"
        return bodies, f"Without the structure: {text}"
    return whole, ""


def _simulation_lines(sim: Simulation) -> Iterator[tuple[str, str]]:
    yield "scene", " ".join(filter(None, (source_of(sim.scene), around(sim.scene))))
    yield "bodies", f"{len(sim.bodies):,} now"
    yield "broad phase", called(sim.broad_phase, sim.options)
    narrow = [called(*each) for each in composition_of(sim).narrow_phases.items()]
    yield "narrow phases", ", ".join(narrow) or "none"
    yield "time", f"{sim.scene.start:.6g} to {sim.time:.10g}"
    if sim.fault is not None:
        yield "ended by", sim.fault
    read = sim.readings.as_dict()
    wanted = {"contacts", "passings", "events", "deepest overlap", "unaccounted energy"}
    wanted |= {"speed", "fingerprint"}
    yield from (line for line in reading_lines(read) if line[0] in wanted and read["events"])


def _scene_lines(scene: Scene) -> Iterator[tuple[str, str]]:
    if source_of(scene):
        yield "from", source_of(scene)
    yield "walls", around(scene)
    if len(scene):
        if scene.shapes:
            counts = Counter(scene.shapes[each].kind for each in scene.shape.tolist())
            yield "shapes", ", ".join(f"{kind} ({count:,})" for kind, count in counts.items())
        else:
            yield "radii", _range(scene.radius.min(), scene.radius.max())
        moved = scene.mass[scene.mass < math.inf]
        still = len(scene) - len(moved)
        masses = [_range(moved.min(), moved.max())] if len(moved) else []
        masses += [f"{in_words(scene, still)} that nothing can move"] if still else []
        yield "masses", "; ".join(masses)
        speed = (scene.velocity**2).sum(axis=1) ** 0.5
        yield "speeds", _range(speed.min(), speed.max())
    if scene.kinds != (0,):
        yield "kinds", ", ".join(f"{kind} ({count:,})" for kind, count in Counter(scene.kind).items())
    if scene.responses:
        rules = ((a, b, called(each.name, each.options)) for (a, b), each in scene.responses)
        yield "responses", "; ".join(f"{a} and {b}: {response}" for a, b, response in rules)
    if scene.commands:
        yield "commands", counted(scene.commands)
    settings = scene.settings
    yield "time", f"from {scene.start:.6g}" + ("" if settings.until is None else f" to {settings.until:.6g}")
    if settings.broad_phase is not None:
        yield "broad phase", called(settings.broad_phase, settings.options.get(settings.broad_phase, {}))


def _range(low: float, high: float) -> str:
    least, most = f"{low:.4g}", f"{high:.4g}"
    return least if least == most else f"{least} to {most}"


_LABEL = "text-align:left;vertical-align:top;padding:.15em .8em .15em 0;white-space:nowrap"
_CELL = "text-align:{side};vertical-align:top;padding:.15em .8em .15em 0"
_TABLE = '<table style="border-collapse:collapse;margin:.3em 0">'
_CAPTION = '<caption style="text-align:left;caption-side:top;padding:.2em 0;font-weight:bold">{}</caption>'


def facts(caption: str, rows: Iterable[tuple[str, str]]) -> str:
    """Returns a table of labels and values."""
    lines = (
        f'<tr><th scope="row" style="{_LABEL}">{escape(label)}</th>'
        f'<td style="{_CELL.format(side="left")};overflow-wrap:anywhere">{escape(text)}</td></tr>'
        for label, text in rows
    )
    return "\n".join([_TABLE, _CAPTION.format(escape(caption)), *lines, "</table>"])


def grid(caption: str, heads: Sequence[str], rows: Iterable[Sequence[str]], numbers: Sequence[bool]) -> str:
    """Returns a table with a head for each column, numbers at the right, which scrolls if it is too wide."""
    sides = ["right;white-space:nowrap" if number else "left" for number in numbers]

    def line(tag: str, texts: Sequence[str]) -> str:
        cells = (
            f'<{tag} style="{_CELL.format(side=side)}">{escape(text)}</{tag.split()[0]}>'
            for text, side in zip(texts, sides, strict=True)
        )
        return f"<tr>{''.join(cells)}</tr>"

    body = "\n".join([line('th scope="col"', heads), *(line("td", row) for row in rows)])
    name = escape(caption)
    return (
        f'<div style="overflow-x:auto" role="region" aria-label="{name}" tabindex="0">'
        f"{_TABLE}\n{_CAPTION.format(name)}\n{body}\n</table></div>"
    )


def paragraph(text: str) -> str:
    """Returns a sentence, with its line breaks."""
    return f'<p style="margin:.3em 0;white-space:pre-wrap;text-align:left">{escape(text)}</p>'


def figure(svg: bytes, words: str, width: int = 480) -> str:
    """Returns a picture as an image of a limited width in pixels, with a text for screen readers."""
    data = b64encode(svg).decode("ascii")
    return (
        f'<img alt="{escape(words)}" style="width:100%;max-width:{width}px;height:auto" '
        f'src="data:image/svg+xml;base64,{data}"/>'
    )
