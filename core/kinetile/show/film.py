"""A film of a run: pictures at evenly spaced times, as an animated GIF, or as a video.

All frames have one view: the arena, or the box that all bodies reach in the whole film.
"""

from __future__ import annotations

import math
import os
from base64 import b64encode
from collections.abc import Callable, Iterator
from copy import copy
from dataclasses import dataclass, replace
from io import BytesIO
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

from kinetile.errors import BadOption, answering
from kinetile.lazy import needed
from kinetile.run.simulation import Simulation, composition_of
from kinetile.scene.checks import is_finite, shown
from kinetile.show.picture import (
    FIXED,
    KINDS,
    LIGHT,
    LOOKS,
    NEXT_LOOK,
    SPEEDS,
    Picture,
    Position,
    counted,
    take_picture,
)
from kinetile.show.player.view import to_show, window
from kinetile.show.printed import as_pixels, check_printing
from kinetile.targets import MARK, writing_new

if TYPE_CHECKING:
    from PIL.Image import Image

FRAMES = 25
"""Frames a second."""

MOST_SECONDS = 200

WIDTHS = (64, 4096)
"""The least and the largest width of a frame in pixels."""

_Counted = Callable[[int, int], None] | None

STEPS = 3
"""Colours of a film between two that meet."""

_FLATTEST = 1e-3  # the least height of a view in widths, and the least width in heights


@dataclass(frozen=True)
class Film:
    """A film of a run; a notebook shows it. ``simulation`` is at the scene's start and does not change,
    ``times`` are the times of the frames, in the scene's time, and ``width`` is in pixels. ``structure`` of
    the broad phase and lines between ``pairs`` are drawn if True (``pairs`` None: as in a picture)."""

    simulation: Simulation
    times: tuple[float, ...]
    width: int
    structure: bool = True
    pairs: bool | None = None

    def frames(self) -> Iterator[Image]:
        """Yields RGB images of Pillow. Raises MissingExtra without matplotlib; else as ``Simulation.run``."""
        check_printing("Drawing a film")
        from PIL.Image import fromarray

        low, high = self._view()
        for time, picture in self._pictures(self.structure):
            caption = self._caption(time, picture)
            pixels = as_pixels(replace(picture, low=low, high=high), self.width, caption)
            yield fromarray(pixels).convert("RGB")

    def save(
        self,
        path: str | os.PathLike[str],
        *,
        overwrite: bool = False,
        progress: Callable[[int, int], None] | None = None,
    ) -> Path:
        """Writes the film to a file that ends in .gif, which is added to a name without an ending, or in .mp4
        (extra ``film``), complete or not at all, and returns its path. A .gif has every second frame, to be
        small. ``progress`` is called after each frame, with the number of frames so far and of all. The film
        replaces another film. Raises MissingExtra without matplotlib, or for .mp4 without PyAV, and
        BadOption for a file of another name, any other file (unless ``overwrite``) or one that cannot be
        written."""
        target = given if (given := Path(path)).suffix else Path(f"{given}.gif")
        write = {".gif": self._write_gif, ".mp4": self._write_mp4}.get(target.suffix.lower())
        if write is None:
            raise BadOption(f"the film is {str(target)!r}; expected a name that ends in .gif or .mp4")
        with writing_new(target, overwrite) as file:
            write(file, progress)
        return target

    def _repr_html_(self) -> str:
        file = BytesIO()
        self._write_gif(file, None)
        content, (first, *_, last) = b64encode(file.getvalue()).decode(), self.times
        return f'<img src="data:image/gif;base64,{content}" alt="A film, time {first:g} to {last:g}">'

    def _write_gif(self, file: BinaryIO, progress: _Counted) -> None:
        check_printing("Drawing a film")
        from PIL import Image

        palette = Image.new("P", (1, 1))
        palette.putpalette(bytes(_palette()))
        step = 2 if len(self.times) > 2 else 1
        images = replace(self, times=self.times[::-step][::-1])._counted(progress)
        frames = (image.quantize(palette=palette, dither=Image.Dither.NONE) for image in images)
        options = {"duration": 1000 * step // FRAMES, "loop": 0, "comment": MARK.encode()}  # milliseconds
        next(frames).save(file, "GIF", save_all=True, append_images=frames, **options)

    def _write_mp4(self, file: BinaryIO, progress: _Counted) -> None:
        av = needed("Writing a film as .mp4", "av", "film")
        images = self._counted(progress)
        first = next(images)
        wide, high = (side // 2 * 2 for side in first.size)  # the format needs even sides
        with av.open(file, "w", format="mp4") as video:
            video.metadata["comment"] = MARK
            stream = video.add_stream("libx264", rate=FRAMES)
            stream.width, stream.height, stream.pix_fmt = wide, high, "yuv420p"
            for image in chain([first], images):
                video.mux(stream.encode(av.VideoFrame.from_image(image.crop((0, 0, wide, high)))))
            video.mux(stream.encode())

    def _counted(self, progress: _Counted) -> Iterator[Image]:
        for done, frame in enumerate(self.frames(), 1):
            yield frame
            if progress is not None:
                progress(done, len(self.times))

    def _pictures(self, structure: bool) -> Iterator[tuple[float, Picture]]:
        simulation, pairs, left_out = copy(self.simulation), self.pairs, ""
        for time in self.times:
            simulation.run(time)
            picture = take_picture(simulation, structure=structure, pairs=pairs)
            left_out = left_out or picture.left_out
            pairs = not left_out if pairs is None else pairs  # the same in all frames: no flicker
            yield time, replace(picture, left_out=left_out)

    def _view(self) -> tuple[Position, Position]:
        """Returns the corners of the film's view; without an arena, a run collects the positions first."""
        if self.simulation.scene.arena is not None:
            return (0.0, 0.0), self.simulation.scene.arena
        views = [(*picture.low, *picture.high) for _, picture in self._pictures(False)]
        lefts, bottoms, rights, tops = zip(*views, strict=True)
        left, bottom, right, top = min(lefts), min(bottoms), max(rights), max(tops)
        # Without an arena, all segments may be on one line: the view then has no width or no height.
        flat = _FLATTEST * max(right - left, top - bottom)
        return (left, bottom), (max(right, left + flat), max(top, bottom + flat))

    def _caption(self, time: float, picture: Picture) -> str:
        """Returns the text below a frame. The time has a fixed number of digits, so that it does not jump."""
        # Two frames may have the same time in a window of a few ulps, but the whole window is never 0.
        whole = math.log10(self.times[-1] - self.times[0])
        digits = 1 - math.floor(whole - math.log10(len(self.times) - 1))
        now = f"{time:.{digits}f}" if 0 < digits < 10 else f"{time:.6g}"
        bodies = len({disc.number for disc in picture.discs})  # images over periodic borders are not bodies
        what = counted(self.simulation.scene, bodies)
        return f"time {now}: {what} under {self.simulation.broad_phase}{picture.left_out}"


@answering
def film(
    simulation: Simulation,
    until: float | None = None,
    *,
    begin: float | None = None,
    seconds: float = 8.0,
    width: int = 640,
    structure: bool = True,
    pairs: bool | None = None,
) -> Film:
    """Returns a film of the run of a simulation so far, with its interactive commands; before a run, of its
    future. The run is repeated from the start, and the simulation does not change.

    Args:
        until: the time of the last frame, in the scene's time; None: the present time, or before a run the
            scene's own ``until``, or one time unit.
        begin: the time of the first frame; None: the scene's start.
        seconds: the duration of the film, at 25 frames a second.
        width: the width of a frame in pixels; a scene taller than twice that is drawn smaller.
        structure: True if the structure of the broad phase is drawn.
        pairs: True if lines between pairs of bodies are drawn; None: up to 400 in the first frame.

    Raises BadOption for values without a film.
    """
    scene = to_show(simulation)
    first, last = window(scene, begin, until)
    if not first < last:
        raise BadOption(f"the film begins and ends at {first!r}; expected an end after the beginning")
    if not is_finite(seconds) or not 0.0 < seconds <= MOST_SECONDS:
        raise BadOption(
            f"the film plays for {shown(seconds)} seconds; expected a number up to {MOST_SECONDS}"
        )
    if not is_finite(width) or not WIDTHS[0] <= width <= WIDTHS[1]:
        raise BadOption(f"a frame is {shown(width)} pixels wide (width); expected {WIDTHS[0]} to {WIDTHS[1]}")
    steps = max(round(seconds * FRAMES), 2) - 1
    times = (*(first + (last - first) * (step / steps) for step in range(steps)), last)
    again = Simulation(
        scene,
        simulation.broad_phase,
        narrow_phases=composition_of(simulation).narrow_phases,
        options=dict(simulation.options) or None,
        keep_contacts=False,
    )
    return Film(again, times, width, structure, pairs)


def _palette() -> Iterator[int]:
    """Yields the colours of all frames: of each body, of each look over the paper and of what is written in
    ``STEPS`` steps. Few colours make long runs of equal pixels, and a small file."""
    from PIL.ImageColor import getrgb

    back, edge = getrgb(LIGHT.back), getrgb(LIGHT.edge)
    over = {look.colour: look for look in (*LOOKS.values(), NEXT_LOOK)}
    for look in over.values():
        yield from (round(x + (y - x) * look.filled) for x, y in zip(back, getrgb(look.colour), strict=True))
    pairs = [(back, getrgb(colour)) for colour in (*over, LIGHT.ink, LIGHT.edge)]
    pairs += [(edge, getrgb(colour)) for colour in (*KINDS, *SPEEDS, FIXED)]
    yield from back
    for one, other in pairs:
        for step in range(1, STEPS + 1):
            yield from (round(x + (y - x) * step / STEPS) for x, y in zip(one, other, strict=True))
