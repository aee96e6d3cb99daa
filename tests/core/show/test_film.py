"""Films: frames at their times, a GIF that Pillow reads again, an MP4 by way of ffmpeg, all or nothing."""

from __future__ import annotations

import math
import re
import sys

import pytest

import kinetile as kt
from command_line import kinetile, refused
from kinetile.errors import BadOption, MissingExtra
from kinetile.show.picture import LIGHT

Image = pytest.importorskip("PIL.Image")

SCENE = kt.Scene([(0.3, 0.5), (0.7, 0.25)], [(1.0, 0.0), (0.0, 0.0)], 0.1, arena=(1.0, 1.0))
SMALL = {"seconds": 0.2, "width": 124}
"""Five frames, in which the arena is 100 pixels wide, 12 from the left and the top."""

COMMAND = "view two-discs --until 0.2 --seconds 0.2 --width 124"


@pytest.fixture(autouse=True)
def in_a_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def small_film(**options):
    return kt.film(kt.Simulation(SCENE, "naive"), 0.2, **SMALL | options)


def fake_ffmpeg(folder, monkeypatch, ends="sys.exit(0)"):
    """Put a program on PATH that writes the number of bytes from its stdin into its last argument."""
    folder.mkdir()
    program = folder / "ffmpeg"
    count = "if sys.argv[1:] == ['-version']: sys.exit()\n"
    count += "open(sys.argv[-1], 'w').write(str(len(sys.stdin.buffer.read())))"
    program.write_text(f"#!{sys.executable}\nimport sys\n{count}\n{ends}\n")
    program.chmod(0o755)
    monkeypatch.setenv("PATH", str(folder))


def test_frames_are_evenly_spaced_from_the_beginning_to_the_end():
    film = small_film(begin=0.1)
    assert film.times == pytest.approx([0.1, 0.125, 0.15, 0.175, 0.2])
    assert (film.times[0], film.times[-1]) == (0.1, 0.2)
    assert len(list(film.frames())) == 5


def test_a_window_of_one_ulp_is_a_film():
    end = math.nextafter(0.1, 1.0)
    film = kt.film(kt.Simulation(SCENE, "naive"), end, begin=0.1, **SMALL)
    assert (len(list(film.frames())), set(film.times)) == (5, {0.1, end})


def test_discs_have_their_colour_where_they_are():
    first, *_, last = small_film(structure=False).frames()
    assert first.size == (124, 144)
    disc, paper = (tuple(bytes.fromhex(colour[1:])) for colour in (LIGHT.disc, LIGHT.back))
    assert (first.getpixel((12 + 30, 12 + 50)), first.getpixel((12 + 70, 12 + 75))) == (disc, disc)
    assert (last.getpixel((12 + 50, 12 + 50)), last.getpixel((12 + 22, 12 + 50))) == (disc, paper)
    assert first.getpixel((2, 70)) == paper


def test_structure_is_drawn_unless_it_is_left_out():
    # Under naive a line joins the two discs: half-way there is nothing else.
    place = (12 + 50, 12 + 62)
    bare, drawn = (next(small_film(structure=each).frames()).getpixel(place) for each in (False, True))
    assert bare == (255, 255, 255)
    assert drawn != bare


def test_what_reaches_over_a_periodic_border_is_drawn_at_both_sides():
    scene = kt.Scene([(0.05, 0.5)], [(0.0, 0.1)], 0.1, arena=(1.0, 1.0), periodic="x")
    frame = next(kt.film(kt.Simulation(scene, "naive"), 0.1, **SMALL).frames())
    assert frame.getpixel((12 + 97, 12 + 50)) == tuple(bytes.fromhex(LIGHT.disc[1:]))


def test_without_an_arena_all_frames_show_what_the_bodies_reach_in_the_film():
    scene = kt.Scene([(0.0, 0.0)], [(1.0, 0.0)], 0.5)
    first, *_, last = kt.film(kt.Simulation(scene, "naive"), 3.0, **SMALL).frames()
    assert first.size == last.size == (124, 69)  # 25 pixels for the disc, 32 for its text, margins
    disc = tuple(bytes.fromhex(LIGHT.disc[1:]))
    assert [frame.getpixel((24, 24)) == disc for frame in (first, last)] == [True, False]
    assert [frame.getpixel((99, 24)) == disc for frame in (first, last)] == [False, True]


def test_it_repeats_the_run_so_far_and_leaves_the_simulation_as_it_is():
    sim = kt.Simulation(SCENE, "naive")
    sim.run(0.1)
    sim.set_velocity(0, (0.0, 0.0))
    sim.run(0.2)
    film = kt.film(sim, **SMALL)
    frame = list(film.frames())[-1]
    assert (film.times[0], film.times[-1], sim.time) == (0.0, 0.2, 0.2)
    assert frame.getpixel((12 + 34, 12 + 50)) == tuple(bytes.fromhex(LIGHT.disc[1:]))  # it stands at 0.4
    assert frame.getpixel((12 + 54, 12 + 50)) == (255, 255, 255)


def test_a_gif_has_all_frames_and_plays_for_ever():
    said = []
    path = small_film(structure=False).save("a.gif", progress=lambda *each: said.append(each))
    assert said == [(done, 5) for done in range(1, 6)]
    with Image.open(path) as gif:
        assert (gif.format, gif.size, gif.n_frames, gif.info["loop"]) == ("GIF", (124, 144), 5, 0)
        for frame in range(5):
            gif.seek(frame)
            assert gif.info["duration"] == 40
            centre = gif.convert("RGB").getpixel((12 + 70, 12 + 75))
            assert centre == pytest.approx(tuple(bytes.fromhex(LIGHT.disc[1:])), abs=4)


def test_a_file_that_is_there_is_replaced_only_if_asked(tmp_path):
    (tmp_path / "a.gif").write_text("mine")
    with pytest.raises(BadOption, match=r"a\.gif is there already"):
        small_film().save("a.gif")
    assert (tmp_path / "a.gif").read_text() == "mine"
    small_film().save("a.gif", overwrite=True)
    assert (tmp_path / "a.gif").read_bytes().startswith(b"GIF89a")


def test_an_interrupted_film_leaves_nothing(tmp_path):
    def stop(done, total):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        small_film().save("a.gif", progress=stop)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"seconds": 0.0}, "plays for 0.0 seconds"),
        ({"seconds": float("nan")}, "plays for nan seconds"),
        ({"seconds": 1e6}, "at most 5000 frames"),
        ({"fps": 60.0}, "60.0 frames a second"),
        ({"fps": 0.001}, "from 0.01 to 50"),
        ({"width": 10}, "10 pixels wide"),
        ({"begin": 0.2}, "begins and ends at 0.2"),
        ({"begin": 0.3}, "expected two times"),
    ],
)
def test_values_that_make_no_film_are_refused(options, said):
    with pytest.raises(BadOption, match=said):
        small_film(**options)


def test_without_pillow_the_extra_is_named(monkeypatch):
    film = small_film()
    monkeypatch.setitem(sys.modules, "PIL", None)
    with pytest.raises(MissingExtra, match=r"Pillow.*kinetile\[figures\]"):
        film.save("a.gif")
    with pytest.raises(MissingExtra, match=r"kinetile\[figures\]"):
        next(film.frames())


def test_without_ffmpeg_an_mp4_is_refused(tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(BadOption, match=r"written by ffmpeg, which is not there.*--gif"):
        small_film().save("a.mp4")


@pytest.mark.skipif(sys.platform == "win32", reason="its programs are no scripts")
def test_ffmpeg_gets_the_bytes_of_all_frames(tmp_path, monkeypatch):
    fake_ffmpeg(tmp_path / "bin", monkeypatch)
    path = small_film().save("a.mp4")
    assert int(path.read_text()) == 5 * 124 * 144 * 3
    assert {each.name for each in tmp_path.iterdir()} == {"a.mp4", "bin"}


@pytest.mark.skipif(sys.platform == "win32", reason="its programs are no scripts")
def test_a_failure_of_ffmpeg_is_told_and_leaves_nothing(tmp_path, monkeypatch):
    fake_ffmpeg(tmp_path / "bin", monkeypatch, ends="sys.exit('no such codec')")
    with pytest.raises(BadOption, match="ffmpeg ended with exit code 1: no such codec"):
        small_film().save("a.mp4")
    assert {each.name for each in tmp_path.iterdir()} == {"bin"}


@pytest.mark.skipif(sys.platform == "win32", reason="its programs are no scripts")
@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            "#!/bin/sh\necho 'no libav.so' >&2\nexit 127\n",
            "ffmpeg, which does not run (no libav.so): install",
        ),
        ("\x7fELF", r"ffmpeg, which does not run ([Errno 8] Exec format error"),
        ("#!/bin/sh\n", "ffmpeg ended with exit code 0 and wrote nothing: no message"),
    ],
)
def test_an_ffmpeg_that_does_not_run_was_used(text, said, tmp_path, monkeypatch):
    fake_ffmpeg(tmp_path / "bin", monkeypatch)
    (tmp_path / "bin" / "ffmpeg").write_text(text)
    with pytest.raises(BadOption, match=re.escape(said)):
        small_film().save("a.mp4")
    assert {each.name for each in tmp_path.iterdir()} == {"bin"}


def test_the_command_writes_a_film_and_a_page_only_if_named(tmp_path):
    result = kinetile(f"{COMMAND} --broad-phase naive --gif a.gif")
    assert result.exit_code == 0, result.stderr
    assert result.stdout.startswith("a.gif: 5 frames, 0.0")
    assert {each.name for each in tmp_path.iterdir()} == {"a.gif"}
    result = kinetile(f"{COMMAND} --broad-phase naive --gif a.gif --out a.html --overwrite")
    assert [line.partition(":")[0] for line in result.stdout.splitlines()] == ["a.gif", "a.html"]


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ("--gif there.gif", "--gif: there.gif is there already: choose another name, or say --overwrite"),
        ("--gif a.png", "expected a name that ends in .gif"),
        ("--gif nowhere/a.gif", "there is no folder"),
        ("--gif a.gif --broad-phase naive --beside cells", "no --beside"),
        ("--gif a.gif --open", "--open and --at are for the page"),
        ("--gif a.gif --broad-phase naiv", "did you mean 'naive'"),
        ("--mp4 a.mp4", "ffmpeg, which is not there"),
        ("--gif a.gif --mp4 a.mp4", "ffmpeg, which is not there"),
        ("--out a.html", "--seconds is for a film"),
    ],
)
def test_what_the_command_refuses(more, said, tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    (tmp_path / "there.gif").write_text("mine")
    assert said in " ".join(refused(f"{COMMAND} {more}").split())
    assert [each.name for each in tmp_path.iterdir()] == ["there.gif"]
    assert (tmp_path / "there.gif").read_text() == "mine"
