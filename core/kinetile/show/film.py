"""A film of a run: frames at evenly spaced times, drawn by Pillow, as an animated GIF or, by ffmpeg, as MP4.

A frame has the shapes, colours and layers of a picture (``svg``), on white, and the time below it. All frames
have one view: the arena, or what all bodies reach in the whole film.
"""

from __future__ import annotations

import math
import os
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterator
from contextlib import suppress
from copy import copy
from dataclasses import dataclass
from itertools import chain, pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO, cast

from kinetile.errors import BadOption, MissingExtra, printable
from kinetile.plugin.drawing import Box, Item, Segment
from kinetile.run.simulation import Simulation
from kinetile.scene.targets import replacing, writable_target
from kinetile.show.picture import LIGHT, LOOKS, NEXT, Picture, Place, corners_of, counted, take_picture
from kinetile.show.player.view import window

if TYPE_CHECKING:
    from PIL.Image import Image

FORMS = (".gif", ".mp4")
"""Endings of films."""

MOST_FRAMES = 5000

WIDTHS = (64, 4096)
"""The least and the largest width of a frame in pixels."""

SLOWEST, FASTEST = 0.01, 50.0
"""Frames a second: a GIF cannot hold intervals above 655 s; those below 1/50 s are shown much slower."""

_MARGIN, _LINE, _FONT = 12, 20, 13
_SHARPER = 2  # a frame is drawn this much larger and reduced, for smooth edges
_FAR = 1e5  # pixels: Pillow walks along a line out of view pixel by pixel


def check_film(path: str | os.PathLike[str]) -> None:
    """Raises MissingExtra or BadOption where a film cannot be written to a file of this name: its ending,
    Pillow or ffmpeg is missing, or ffmpeg does not run."""
    form = Path(path).suffix.lower()
    if form not in FORMS:
        raise BadOption(f"the film is {str(path)!r}; expected a name that ends in .gif or .mp4")
    try:
        from PIL import Image  # noqa: F401
    except ImportError as error:
        raise MissingExtra("Drawing a film", "Pillow", "figures") from error
    fault = _fault_of_ffmpeg() if form == ".mp4" else ""
    if fault:
        raise BadOption(
            f"MP4 is written by ffmpeg, which {fault}: install it so that it is on PATH, or write a GIF "
            "(--gif), which needs no ffmpeg"
        )


def _fault_of_ffmpeg() -> str:
    """Returns "" where ffmpeg is on PATH and runs: a program that is there may lack a library."""
    path = shutil.which("ffmpeg")
    if path is None:
        return "is not there"
    try:
        done = subprocess.run(
            [path, "-version"], stdin=subprocess.DEVNULL, capture_output=True, timeout=60, check=False
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        return f"does not run ({printable(str(error))})"
    return f"does not run ({_last_line(done.stderr)})" if done.returncode else ""


def _last_line(said: bytes) -> str:
    lines = said.decode(errors="replace").strip().splitlines() or ["no message"]
    return printable(lines[-1])


@dataclass(frozen=True)
class Film:
    """A film of a run.

    Attributes:
        simulation: the run at the scene's start; it does not change.
        times: the times of the frames, in the scene's time.
        fps: frames a second.
        width: of a frame, in pixels.
        structure: whether the structure of the broad phase is drawn.
    """

    simulation: Simulation
    times: tuple[float, ...]
    fps: float
    width: int
    structure: bool = True

    def frames(self) -> Iterator[Image]:
        """Yields the frames as RGB images of Pillow. Raises MissingExtra without it, and as
        ``Simulation.run``."""
        check_film("film.gif")
        sheet = _Sheet(*self._view(), self.width)
        for time, picture in self._pictures(self.structure):
            yield _drawn(sheet, picture, self._caption(time, picture))

    def save(
        self,
        path: str | os.PathLike[str],
        *,
        overwrite: bool = False,
        progress: Callable[[int, int], None] | None = None,
    ) -> Path:
        """Writes the film to a file that ends in .gif or .mp4, complete or not at all, and returns its path.

        ``progress`` is called after each frame, with the number of frames so far and of all.

        Raises MissingExtra without Pillow, and BadOption where the file is there already (unless
        ``overwrite``) or cannot be written, or where ffmpeg is missing or fails.
        """
        check_film(path)
        target = Path(path)
        try:
            place = writable_target(target)
            if place.exists() and not overwrite:
                raise BadOption(
                    f"{target} is there already: choose another name, or have it overwritten (overwrite=True)"
                )
            with replacing(place) as file:
                frames = self._counted(progress)
                if target.suffix.lower() == ".gif":
                    _write_gif(frames, file, self.fps, len(self.times))
                else:
                    _write_mp4(frames, file, self.fps)
        except OSError as error:
            raise BadOption(f"{target} cannot be written: {error.strerror or error}") from error
        return target

    def _counted(self, progress: Callable[[int, int], None] | None) -> Iterator[Image]:
        for done, frame in enumerate(self.frames(), 1):
            yield frame
            if progress is not None:
                progress(done, len(self.times))

    def _pictures(self, structure: bool) -> Iterator[tuple[float, Picture]]:
        simulation = copy(self.simulation)
        for time in self.times:
            simulation.run(time)
            yield time, take_picture(simulation, structure=structure)

    def _view(self) -> tuple[Place, Place]:
        """Returns the corners of what the film shows; without an arena, by a run for the positions alone."""
        if self.simulation.scene.arena is not None:
            return (0.0, 0.0), self.simulation.scene.arena
        views = [(*picture.low, *picture.high) for _, picture in self._pictures(False)]
        lefts, bottoms, rights, tops = zip(*views, strict=True)
        return (min(lefts), min(bottoms)), (max(rights), max(tops))

    def _caption(self, time: float, picture: Picture) -> str:
        """Returns the text below a frame. The time has a fixed number of digits, so that it does not jump."""
        # Two frames may have the same time, in a window of a few ulps: the whole of it is never 0.
        whole = math.log10(self.times[-1] - self.times[0])
        digits = 1 - math.floor(whole - math.log10(len(self.times) - 1))
        now = f"{time:.{digits}f}" if 0 < digits < 10 else f"{time:.6g}"
        bodies = len({disc.number for disc in picture.discs})  # images over periodic borders are no bodies
        what = counted(self.simulation.scene, bodies)
        return f"time {now}: {what} under {self.simulation.broad_phase}"


def film(
    simulation: Simulation,
    until: float | None = None,
    *,
    begin: float | None = None,
    seconds: float = 8.0,
    fps: float = 25.0,
    width: int = 640,
    structure: bool = True,
) -> Film:
    """Returns a film of the run of a simulation so far, including interactive commands; before a run, of its
    future. It is run again from the start, and the simulation does not change.

    Args:
        simulation: the simulation.
        until: the time of the last frame, in the scene's time; None: the present time, or before a run one
            time unit.
        begin: that of the first frame; None: the scene's start.
        seconds: how long the film plays.
        fps: frames a second.
        width: of a frame, in pixels; a scene taller than twice that is drawn smaller.
        structure: whether the structure of the broad phase is drawn.

    Raises BadOption for values that make no film.
    """
    scene = simulation.recorded()
    first, last = window(scene, begin, until)
    if not first < last:
        raise BadOption(f"the film begins and ends at {first!r}; expected an end after the beginning")
    if not SLOWEST <= fps <= FASTEST:
        raise BadOption(
            f"the film has {fps!r} frames a second; expected a number from {SLOWEST} to {FASTEST:g}"
        )
    if not 0.0 < seconds <= MOST_FRAMES / fps:
        raise BadOption(
            f"the film plays for {seconds!r} seconds; expected a number up to {MOST_FRAMES / fps:g}: "
            f"a film has at most {MOST_FRAMES} frames"
        )
    if not WIDTHS[0] <= width <= WIDTHS[1]:
        raise BadOption(f"a frame is {width} pixels wide; expected {WIDTHS[0]} to {WIDTHS[1]}")
    steps = max(round(seconds * fps), 2) - 1
    times = (*(first + (last - first) * (step / steps) for step in range(steps)), last)
    again = Simulation(
        scene,
        simulation.broad_phase,
        narrow_phases=simulation.composition.narrow_phases,
        options=dict(simulation.options) or None,
        keep_contacts=False,
    )
    return Film(again, times, fps, width, structure)


class _Sheet:
    """A frame's size, and the places of the scene's points on it before it is reduced: y goes down there."""

    def __init__(self, low: Place, high: Place, width: int) -> None:
        (left, bottom), (right, top) = low, high
        inner = width - 2.0 * _MARGIN
        # Bodies without an arena may all be on one line, and a view then has no width or no height.
        scale = min(
            inner / (right - left) if right > left else math.inf,
            2.0 * inner / (top - bottom) if top > bottom else math.inf,
        )
        wide, tall = (right - left) * scale, (top - bottom) * scale
        self.scale = scale * _SHARPER
        self.left, self.top = left - (width - wide) / 2.0 / scale, top + _MARGIN / scale
        self.size = width * _SHARPER, (math.ceil(tall) + 2 * _MARGIN + _LINE) * _SHARPER
        self.view = tuple(
            round(_SHARPER * side)
            for side in ((width - wide) / 2.0, _MARGIN, (width + wide) / 2.0, _MARGIN + tall)
        )

    def at(self, point: Place) -> Place:
        """Returns where a point of the scene is."""
        x, y = (point[0] - self.left) * self.scale, (self.top - point[1]) * self.scale
        return min(max(x, -_FAR), _FAR), min(max(y, -_FAR), _FAR)


def _drawn(sheet: _Sheet, picture: Picture, caption: str) -> Image:
    """Returns a frame, in the layers of a picture: shapes, bodies, shapes that lie over these."""
    from PIL import Image, ImageDraw, ImageFont

    seen = Image.new("RGB", sheet.size, LIGHT.back)
    draw = ImageDraw.Draw(seen, "RGBA")
    for over in (False, True):
        for role in (role for role in picture.roles if LOOKS[role].over == over):
            shapes = (shape for shape in picture.shapes if shape.role == role)
            for shape in sorted(shapes, key=picture.is_next):
                _draw_shape(draw, sheet, shape, picture.is_next(shape))
        if not over:
            _draw_bodies(draw, sheet, picture)
    left, top, right, bottom = sheet.view
    rim = 2 * _SHARPER
    box = (left - rim, top - rim, right + rim, bottom + rim)
    frame = Image.new("RGB", sheet.size, LIGHT.back)
    frame.paste(seen.crop(box), box[:2])  # what reaches out of the view is cut off
    draw = ImageDraw.Draw(frame)
    if picture.arena:
        draw.rectangle(sheet.view, outline=LIGHT.ink, width=round(1.5 * _SHARPER))
    font = ImageFont.load_default(_FONT * _SHARPER)
    down = sheet.size[1] - (_MARGIN + _LINE // 4) * _SHARPER
    draw.text((_MARGIN * _SHARPER, down), caption, LIGHT.ink, font, anchor="ls")
    return frame.reduce(_SHARPER)


def _draw_shape(draw: Any, sheet: _Sheet, shape: Item, is_next: bool) -> None:
    look = NEXT if is_next else LOOKS[shape.role]
    corners = corners_of(shape)
    if isinstance(shape, Box):  # one that is about to vanish may have its sides exchanged by rounding
        (left, low), _, (right, high), _ = corners
        right, high = max(left, right), max(low, high)
        corners = [(left, low), (right, low), (right, high), (left, high)]
    points = list(map(sheet.at, corners))
    if not isinstance(shape, Segment):
        if look.filled:
            draw.polygon(points, fill=f"{look.colour}{round(255 * look.filled):02x}")
        points.append(points[0])
    width = max(round(look.width * _SHARPER), 1)
    for line in _dashed(points, look.dashes) if look.dashes else [points]:
        draw.line(line, fill=look.colour, width=width)


def _dashed(points: list[Place], dashes: tuple[float, ...]) -> Iterator[list[Place]]:
    """Yields the dashes of a line through points; each of its parts begins with one."""
    on, off = (length * _SHARPER for length in dashes)
    for (x, y), (to_x, to_y) in pairwise(points):
        length = math.hypot(to_x - x, to_y - y)
        begun = 0.0
        while begun < length:
            shares = begun / length, min(begun + on, length) / length
            yield [(x + share * (to_x - x), y + share * (to_y - y)) for share in shares]
            begun += on + off


def _draw_bodies(draw: Any, sheet: _Sheet, picture: Picture) -> None:
    for disc in picture.discs:
        if disc.shape is not None:
            points = list(map(sheet.at, disc.outline))
            draw.polygon(points, fill=LIGHT.disc)
            draw.line([*points, points[0]], fill=LIGHT.edge, width=_SHARPER)
            continue
        (x, y), reach = sheet.at(disc.at), max(disc.radius * sheet.scale, 1.0)
        box = (x - reach, y - reach, x + reach, y + reach)
        draw.ellipse(box, fill=LIGHT.disc, outline=LIGHT.edge, width=_SHARPER)


def _write_gif(frames: Iterator[Image], file: BinaryIO, fps: float, count: int) -> None:
    """Writes frames as a GIF that plays for ever; its unit of time is a hundredth of a second."""
    from PIL import Image

    palette = Image.new("P", (1, 1))
    palette.putpalette(bytes(_palette()))
    mapped = (frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames)
    ends = [round(100.0 * frame / fps) for frame in range(count + 1)]
    durations = [10 * (end - begin) for begin, end in pairwise(ends)]
    first = next(mapped)
    first.save(file, "GIF", save_all=True, append_images=mapped, duration=durations, loop=0)


def _palette() -> Iterator[int]:
    """Yields the 242 colours of all frames: each colour of a look in 16 steps over the paper and over a disc.
    A palette for each frame would make colours flicker."""
    from PIL.ImageColor import getrgb

    colours = {look.colour: None for look in (*LOOKS.values(), NEXT)} | {LIGHT.ink: None, LIGHT.edge: None}
    for back in (LIGHT.back, LIGHT.disc):
        yield from getrgb(back)
        for colour in colours:
            for step in range(1, 16):
                pairs = zip(getrgb(back), getrgb(colour), strict=True)
                yield from (round(under + (over - under) * step / 15) for under, over in pairs)


def _write_mp4(frames: Iterator[Image], file: BinaryIO, fps: float) -> None:
    """Writes frames as MP4, by ffmpeg, into the file of this name; the codec is ffmpeg's choice."""
    first = next(frames)
    raw = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", "{}x{}".format(*first.size), "-r", f"{fps:g}"]
    # Players expect a colour for 2 x 2 pixels, so width and height become even.
    even = ["-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2:color=white", "-pix_fmt", "yuv420p"]
    command = ["ffmpeg", "-y", "-loglevel", "error", *raw, "-i", "-", *even]
    command += ["-movflags", "+faststart", "-f", "mp4", file.name]
    with tempfile.TemporaryFile() as said:
        # In a session of its own, ffmpeg is not ended by Ctrl-C before this process is. Where it ends by
        # itself, its message and not the broken pipe says why.
        with (
            suppress(BrokenPipeError),
            subprocess.Popen(
                command, stdin=subprocess.PIPE, stdout=said, stderr=said, start_new_session=True
            ) as ffmpeg,
        ):
            try:
                for frame in chain([first], frames):
                    cast(BinaryIO, ffmpeg.stdin).write(frame.tobytes())
            except BrokenPipeError:
                pass  # it ends by itself
            except BaseException:
                ffmpeg.kill()
                raise
        if ffmpeg.returncode or not Path(file.name).stat().st_size:
            said.seek(0)
            nothing = "" if ffmpeg.returncode else " and wrote nothing"
            ended = f"ffmpeg ended with exit code {ffmpeg.returncode}{nothing}"
            raise BadOption(f"{ended}: {_last_line(said.read())}")
