"""How large a page of the player is, how soon it is there, and how many frames a second it draws.

``PYTHONPATH=tests python docs/figures/player_measured.py`` prints what stands in docs/player.md: sizes of
pages, those of 100, 1,024 and 10,000 discs at density .5 over one time unit, and frames of 1,024 and 5,000
discs with all tiles, bounds and pairs (``--frames``: these alone), in a headless chromium that draws without
a GPU. Processor time is that of all its processes, and of a page that of making it.
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from pathlib import Path

import kinetile as kt
from chromium import Browser
from kinetile.show.player import View, view_scene

PHASE = "sweep-tiling"

FRAMES = """new Promise((done) => {
    const player = kinetilePlayer;
    const own = player.frame.bind(player);
    let [frames, first, spent] = [0, 0, 0];
    player.frame = (now) => {
        const began = performance.now();
        own(now);
        spent += performance.now() - began;
    };
    player.toggle();
    const look = (now) => {
        first ||= now;
        frames += 1;
        if (now - first < SECONDS * 1000) return requestAnimationFrame(look);
        player.toggle();
        player.frame = own;
        return done([1000 * (frames - 1) / (now - first), spent / frames, frames]);
    };
    requestAnimationFrame(look);
})"""


def processor_time(process: int) -> float:
    """Return the seconds that all descendants of a process have had of the processor."""
    times: dict[int, list[tuple[int, float]]] = {}
    for each in filter(str.isdigit, os.listdir("/proc")):
        try:
            fields = Path(f"/proc/{each}/stat").read_text().rpartition(")")[2].split()
        except OSError:
            continue
        spent = (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
        times.setdefault(int(fields[1]), []).append((int(each), spent))
    todo, total = [process], 0.0
    while todo:
        for child, spent in times.get(todo.pop(), []):
            total += spent
            todo.append(child)
    return total


def busy() -> str:
    """Returns what else the machine does."""
    return f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores"


def page_of(bodies: int, folder: Path, begin: float, until: float) -> tuple[View, Path, float]:
    """Returns a page of discs, its file, and the seconds that it took."""
    scene = kt.make_scene("grid", bodies=bodies, density=0.5)
    began = time.process_time()
    view = view_scene(scene, [(PHASE, {})], begin=begin, until=until, pairs=True)
    path = view.save(folder / f"{bodies}-{begin}.html", overwrite=True)
    return view, path, time.process_time() - began


def measure_pages(folder: Path) -> None:
    """Prints how long pages take, and how large they are."""
    for bodies in (100, 1024, 10_000):
        view, path, made = page_of(bodies, folder, 0.0, 1.0)
        (run,) = view.page.recordings
        print(
            f"{bodies} discs: {len(run.rows)} rows, up to {run.end / 2**52:.4g}, made in {made:.0f} s of "
            "processor time",
            flush=True,
        )
        for note in view.notes:
            print("   ", note, flush=True)
        measure_opening(path)


def measure_sizes(folder: Path) -> None:
    """Prints the sizes of pages with steps and without."""
    few = kt.make_scene("random", bodies=24, density=0.3, radius_ratio=4, seed=4)
    many = kt.make_scene("grid", bodies=1024, density=0.5)
    for scene, until, steps in ((few, 0.12, True), (few, 0.3, True), (many, 0.2, False), (many, 0.2, True)):
        view = view_scene(scene, [(PHASE, {})], until=until, steps=steps, pairs=True)
        size = view.save(folder / "size.html", overwrite=True).stat().st_size
        stepped = "with" if steps else "without"
        print(f"{len(scene)} discs until {until}, {stepped} steps: {size / 1e6:.2f} MB", flush=True)


def measure_opening(path: Path) -> None:
    """Prints when the first picture of a page is there."""
    with Browser() as browser:
        before = processor_time(browser.process.pid)
        browser.open(path)
        ready = int(browser.value("document.documentElement.dataset.ready")) / 1000
        spent = processor_time(browser.process.pid) - before
    print(
        f"    {path.stat().st_size / 1e6:.2f} MB, first picture after {ready:.2f} s and {spent:.1f} s of "
        f"processor time; {busy()}",
        flush=True,
    )


def measure_frames(path: Path, seconds: int = 5) -> None:
    """Prints how many frames a second a page draws, and what one costs."""
    with Browser() as browser:
        browser.open(path)
        browser.press("e", *["ArrowDown"] * 3)  # the events there are last longer than the measurement
        for name, key in (("whole scene, structure", None), ("without structure", "t"), ("zoomed in", "t")):
            browser.press(*([key] if key else []), *(["z"] * 3 if name == "zoomed in" else []))
            before = processor_time(browser.process.pid)
            rate, script, frames = browser.value(FRAMES.replace("SECONDS", str(seconds)))
            spent = (processor_time(browser.process.pid) - before) * 1000 / frames
            print(
                f"{name}: {rate:.0f} frames a second; a frame takes {script:.1f} ms in the script, and "
                f"{spent:.0f} ms of processor time in all; {busy()}",
                flush=True,
            )


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        if "--frames" not in sys.argv:
            measure_sizes(Path(folder))
            measure_pages(Path(folder))
        view, path, _ = page_of(1024, Path(folder), 0.05, 0.0501)
        print(
            f"1024 discs from 0.05 to 0.0501; {view.notes or 'all events with their structure'}", flush=True
        )
        measure_frames(path)
        scene = kt.make_scene("grid", bodies=5000, density=0.5)
        print("5000 discs up to 0.02, their structure computed in the page", flush=True)
        measure_frames(
            view_scene(scene, [(PHASE, {})], until=0.02, steps=False, pairs=True).save(
                Path(folder) / "5000.html"
            )
        )
