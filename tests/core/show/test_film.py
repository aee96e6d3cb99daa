"""Films: frames at their times, a GIF that Pillow reads again, all or nothing."""

import math
import sys
from pathlib import Path

import pytest

import kinetile as kt
from command_line import kinetile
from kinetile.errors import BadOption, MissingExtra
from kinetile.show.picture import LIGHT, SPEEDS
from messages import table

pytest.importorskip("matplotlib")
Image = pytest.importorskip("PIL.Image")

SCENE = kt.Scene([(0.3, 0.5), (0.7, 0.25)], [(1.0, 0.0), (0.0, 0.0)], 0.1, arena=(1.0, 1.0))
SMALL = {"seconds": 0.2, "width": 124}
"""Five frames with an arena 100 pixels wide, 12 from the left and the top."""

COMMAND = "view two-discs --until 0.2 --seconds 0.2 --width 124"
FAST, DISC, REST, PAPER = (
    tuple(bytes.fromhex(colour[1:])) for colour in (SPEEDS[5], SPEEDS[3], SPEEDS[0], LIGHT.back)
)


@pytest.fixture(autouse=True)
def in_a_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def small_film(scene=SCENE, until=0.2, **options):
    return kt.film(kt.Simulation(scene, "naive"), until, **SMALL | options)


def has_run():
    sim = kt.Simulation(SCENE, "naive")
    sim.run(until=0.1)
    return sim


test_message = table(globals())


def test_frames_are_evenly_spaced_from_the_beginning_to_the_end():
    film = small_film(begin=0.1)
    assert film.times == pytest.approx([0.1, 0.125, 0.15, 0.175, 0.2])
    assert (film.times[0], film.times[-1]) == (0.1, 0.2)
    assert len(list(film.frames())) == 5


def test_a_window_of_one_ulp_is_a_film():
    end = math.nextafter(0.1, 1.0)
    film = small_film(until=end, begin=0.1)
    assert (len(list(film.frames())), set(film.times)) == (5, {0.1, end})


def test_discs_have_their_colour_where_they_are():
    first, *_, last = small_film(structure=False).frames()
    assert first.size == (124, 144)
    assert (first.getpixel((12 + 30, 12 + 50)), first.getpixel((12 + 70, 12 + 75))) == (FAST, REST)
    assert (last.getpixel((12 + 50, 12 + 50)), last.getpixel((12 + 22, 12 + 50))) == (FAST, PAPER)
    assert first.getpixel((2, 70)) == PAPER


def test_structure_is_drawn_unless_it_is_left_out():
    # Under naive a line joins the two discs: half-way there is nothing else.
    place = (12 + 50, 12 + 62)
    bare, drawn = (next(small_film(structure=each).frames()).getpixel(place) for each in (False, True))
    assert bare == PAPER
    assert drawn != bare


def test_what_reaches_over_a_periodic_border_is_drawn_at_both_sides():
    scene = kt.Scene([(0.05, 0.5)], [(0.0, 0.1)], 0.1, arena=(1.0, 1.0), periodic="x")
    frame = next(small_film(scene, 0.1).frames())
    assert frame.getpixel((12 + 97, 12 + 50)) == DISC


def test_without_an_arena_all_frames_show_what_the_bodies_reach_in_the_film():
    scene = kt.Scene([(0.0, 0.0)], [(1.0, 0.0)], 0.5)
    first, *_, last = small_film(scene, 3.0).frames()
    assert first.size == last.size == (124, 69)  # 25 pixels for the disc, 20 for its text, margins
    assert [frame.getpixel((24, 24)) == DISC for frame in (first, last)] == [True, False]
    assert [frame.getpixel((99, 24)) == DISC for frame in (first, last)] == [False, True]


def test_a_view_without_height_is_a_film():
    line = kt.segment((-1.0, 0.0), (1.0, 0.0))
    scene = kt.Scene([(0.0, 0.0)], [(1.0, 0.0)], mass=math.inf, shape=line)
    assert next(small_film(scene, 1.0).frames()).size == (124, 45)


def test_it_repeats_the_run_so_far_and_leaves_the_simulation_as_it_is():
    sim = kt.Simulation(SCENE, "naive")
    sim.run(0.1)
    sim.set_velocity(0, (0.0, 0.0))
    sim.run(0.2)
    film = kt.film(sim, **SMALL)
    frame = list(film.frames())[-1]
    assert (film.times[0], film.times[-1], sim.time) == (0.0, 0.2, 0.2)
    assert frame.getpixel((12 + 34, 12 + 50)) == REST  # at 0.4
    assert frame.getpixel((12 + 54, 12 + 50)) == PAPER


def test_a_gif_has_every_second_frame_and_plays_for_ever():
    said = []
    path = small_film(structure=False).save("a.gif", progress=lambda *each: said.append(each))
    assert said == [(done, 3) for done in range(1, 4)]
    with Image.open(path) as gif:
        assert (gif.format, gif.size, gif.n_frames, gif.info["loop"]) == ("GIF", (124, 144), 3, 0)
        for frame in range(3):
            gif.seek(frame)
            assert gif.info["duration"] == 80
            assert gif.convert("RGB").getpixel((12 + 70, 12 + 75)) == pytest.approx(REST, abs=4)


def test_an_interrupted_film_leaves_nothing(tmp_path):
    def stop(done, total):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        small_film().save("a.gif", progress=stop)
    assert list(tmp_path.iterdir()) == []


def test_a_film_that_cannot_be_saved(monkeypatch):
    film = small_film()
    Path("there.gif").write_text("mine")
    with pytest.raises(BadOption, match=r"there\.gif is there already"):
        film.save("there.gif")
    assert Path("there.gif").read_text() == "mine"
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(MissingExtra, match=r"matplotlib.*kinetile\[figures\]"):
        film.save("a.gif")


def test_saving_again_replaces_a_film_or_a_page_and_nothing_else():
    page = kt.view(kt.Simulation(SCENE, "naive"))
    for shown, path in (small_film(), Path("a.gif")), (page, Path("a.html")):
        assert [shown.save("a"), shown.save("a"), shown.save(path)] == [path] * 3
        path.write_text("mine")
        with pytest.raises(BadOption, match=rf"{path} is there already"):
            shown.save("a")
        assert shown.save(path, overwrite=True).read_bytes() != b"mine"


def test_a_video_has_all_frames():
    av = pytest.importorskip("av")
    film = small_film(structure=False, width=125)
    path = film.save("a.mp4")
    assert film.save(path) == path
    with av.open(str(path)) as video:
        frames, rate = list(video.decode(video=0)), video.streams[0].average_rate
    assert (len(frames), frames[0].width, frames[0].height, rate) == (5, 124, 144, 25)
    assert frames[0].to_image().getpixel((12 + 30, 12 + 50)) == pytest.approx(FAST, abs=24)


def test_a_notebook_shows_a_film():
    assert small_film()._repr_html_().startswith('<img src="data:image/gif;base64,R0lGODlh')


def test_the_command_writes_a_film(tmp_path):
    result = kinetile(f"{COMMAND} --broad-phase naive --out a.gif")
    assert (result.exit_code, result.stdout[:7]) == (0, "a.gif: "), result.stderr
    assert (tmp_path / "a.gif").read_bytes().startswith(b"GIF89a")


@pytest.mark.slow
def test_a_film_says_in_each_frame_that_pairs_are_left_out():
    cases = (256, None, False, True), (16, None, True, False), (16, False, False, False)
    for bodies, pairs, drawn, said in cases:
        film = small_film(kt.make_scene("grid", bodies=bodies), pairs=pairs)
        time, picture = next(film._pictures(True))
        assert ("pair" in picture.roles) == drawn
        assert film._caption(time, picture).endswith(", without pairs (--pairs)") == said
