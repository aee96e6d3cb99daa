"""Pictures: the same bytes each time, everything in its place, nothing from elsewhere."""

import math
import re
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest

import kinetile as kt
from kinetile.plugin.drawing import ROLES, Box, points_of
from kinetile.show.picture import DARK, FIXED, KINDS, LIGHT, LOOKS, SPEEDS, picture_of_scene, take_picture
from kinetile.show.printed import as_printed
from kinetile.show.svg import INSET, LENGTH, as_svg
from lanes import BUILT_IN, first
from player_pages import torus

SVG = "{http://www.w3.org/2000/svg}"


def simulation(phase="sweep-tiling", until=0.2):
    sim = kt.Simulation(kt.make_scene("random", bodies=9, density=0.3, radius_ratio=3.0, seed=4), phase)
    sim.run(until=until)
    return sim


def read(svg):
    return ElementTree.fromstring(svg)


@pytest.mark.parametrize("phase", first(3, BUILT_IN))
def test_the_same_moment_gives_the_same_bytes(phase):
    one, two = (as_svg(take_picture(simulation(phase)), velocities=True) for _ in range(2))
    assert one == two
    read(one)


def test_discs_are_circles_where_the_bodies_are():
    sim = simulation()
    circles = read(as_svg(take_picture(sim))).findall(f".//{SVG}circle")
    found = sorted([float(circle.get(name)) for name in ("cx", "cy", "r")] for circle in circles)
    bodies = zip(sim.positions().tolist(), sim.scene.radius.tolist(), strict=True)
    wanted = sorted(
        [INSET + LENGTH * x, INSET + LENGTH * (1 - y), LENGTH * radius] for (x, y), radius in bodies
    )
    assert np.array(found) == pytest.approx(np.array(wanted), abs=0.006)


def contrast(one, other):
    """Return the ratio of two luminances, as WCAG 2 defines it."""

    def luminance(colour):
        shares = np.array(list(bytes.fromhex(colour[1:]))) / 255.0
        linear = np.where(shares <= 0.04045, shares / 12.92, ((shares + 0.055) / 1.055) ** 2.4)
        return float(linear @ [0.2126, 0.7152, 0.0722]) + 0.05

    low, high = sorted((luminance(one), luminance(other)))
    return high / low


@pytest.mark.parametrize("paper", [LIGHT, DARK])
def test_bodies_stand_out_from_the_paper_and_their_numbers_from_them(paper):
    for colour in (*KINDS, *SPEEDS, FIXED):
        assert max(contrast(colour, paper.back), contrast(paper.edge, paper.back)) >= 3.0
        assert contrast(colour, "#000000") >= 3.0


def test_bodies_have_the_colour_of_their_kind_or_speed():
    places, speeds = [(0.2, 0.5), (0.5, 0.5), (0.8, 0.5)], [(0.0, 0.0), (0.0, 0.0), (1.0, 0.0)]
    plain = kt.Scene(places, speeds, 0.1, arena=(1.0, 1.0), mass=[math.inf, 1.0, 1.0])
    assert [disc.colour for disc in picture_of_scene(plain).discs] == [FIXED, SPEEDS[0], SPEEDS[5]]
    kinds = kt.Scene(places, speeds, 0.1, arena=(1.0, 1.0), kind=["plate", "ball", "ball"])
    sim = kt.Simulation(kinds, "naive")
    assert [disc.colour for disc in take_picture(sim).discs] == [KINDS[0], KINDS[1], KINDS[1]]


def test_every_shape_is_drawn_once_in_the_group_of_its_role():
    picture = take_picture(simulation())
    root = read(as_svg(picture))
    for role in ROLES:
        groups = [g for g in root.iter(f"{SVG}g") if g.get("class") == role]
        wanted = sum(shape.role == role for shape in picture.shapes)
        assert sum(len(group) for group in groups) == wanted + (wanted > 0)  # and its swatch in the legend
    marked = [each for each in root.iter() if each.get("class") == "next"]
    assert len(marked) == 1 + sum(shape.fails == picture.next for shape in picture.shapes)


def test_titles_say_when_a_certificate_fails():
    sim = simulation()
    event = sim.next_event
    while event.kind != "structural":
        sim.step()
        event = sim.next_event
    root = read(as_svg(take_picture(sim)))
    (first,) = [each for each in root.iter(f"{SVG}rect") if each.get("class") == "next" and len(each)]
    assert first[0].text == f"tile, fails at {event.time:.6g}"


def test_it_is_complete_in_light_and_dark():
    text = as_svg(take_picture(simulation())).decode()
    assert "prefers-color-scheme:dark" in text
    assert not re.search(r"href|src=|url\((?!#)|@import|<script", text)
    root = read(text)
    assert root.get("role") == "img"
    assert root.find(f"{SVG}title").text == "random: 9 discs under sweep-tiling at time 0.2"


def test_roles_choose_what_is_shown():
    shown = take_picture(simulation(), ["pair"])
    assert {shape.role for shape in shown.shapes} == {"pair"}
    assert shown.next is None
    with pytest.raises(ValueError, match="'tiles' is not a role; expected some of bound, tile"):
        take_picture(simulation(), ["tiles"])


def test_every_role_has_a_look():
    assert set(LOOKS) == set(ROLES)
    assert len({(look.colour, look.dashes) for look in LOOKS.values()}) == len(LOOKS)


@pytest.mark.parametrize(("form", "begins"), first(1, [("png", b"\x89PNG"), ("pdf", b"%PDF")]))
def test_printed(form, begins):
    pytest.importorskip("matplotlib")
    one, two = (as_printed(take_picture(simulation("sap-2d")), form, velocities=True) for _ in range(2))
    assert one.startswith(begins)
    assert one == two


def test_control_characters_in_names_made_no_xml(tmp_path):
    path = tmp_path / "a\x1b[31m\x00b.toml".replace("\x00", "\x01")
    kt.save_scene(kt.make_scene("two-discs"), path)
    sim = kt.Simulation(kt.load_scene(path), "cells")
    picture = take_picture(sim)
    odd = replace(picture, shapes=tuple(replace(each, label="\x07\ufffe") for each in picture.shapes))
    for svg in (as_svg(odd), kt.as_svg(sim.scene).encode()):
        assert rb"a\x1b[31m\x01b: 2 discs" in svg
        assert read(svg).find(f"{SVG}title").text.isprintable()


def test_a_segment_is_within_the_view_and_has_no_number_on_it():
    # Drawn by the circle around its end, a room of segments was a third of the view, under its numbers.
    room = kt.Scene(
        [(0.0, 0.0), (0.0, 0.0), (1.0, 1.0)],
        [(0.0, 0.0), (0.0, 0.0), (1.0, 0.0)],
        mass=[math.inf, math.inf, 1.0],
        shape=[0, 1, 2],
        shapes=[kt.segment((0.0, 0.0), (4.0, 0.0)), kt.segment((0.0, 0.0), (0.0, 3.0)), kt.box(1.0, 0.5)],
    )
    picture = picture_of_scene(room)
    assert (picture.low, picture.high) == ((0.0, 0.0), (4.0, 3.0))
    (numbers,) = (group for group in read(as_svg(picture)).iter(f"{SVG}g") if group.get("class") == "number")
    assert [text.text for text in numbers] == ["2"]


def test_tiles_cover_a_cylinder_once_wherever_its_bodies_cross_the_border():
    sim = kt.Simulation(torus("x"), "sweep-tiling")
    for time in np.linspace(0.0, 3.0, 4).tolist():
        sim.run(time)
        tiles = [each for each in take_picture(sim, ["tile"]).shapes if isinstance(each, Box)]
        corners = np.clip([(*each.low, *each.high) for each in tiles], 0.0, 1.0)
        assert ((corners[:, 2:] - corners[:, :2]).prod(axis=1)).sum() == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("periodic", "shaped"), first(2, [("xy", True), ("y", False), ("xy", False), ("x", True)])
)
def test_lines_between_two_bodies_go_the_short_way_round(periodic, shaped):
    """A certificate of sap-2d went the long way round along the axis on which it watches nothing."""
    scene = torus(periodic, shaped)
    sim, lines = kt.Simulation(scene, "sap-2d"), 0
    for time in np.linspace(0.0, 2.0, 6).tolist():
        sim.run(time)
        for each in take_picture(sim, ["pair", "certificate"]).shapes:
            for period, (one, other) in zip(scene.periods, zip(*points_of(each), strict=True), strict=True):
                # From centre to centre it is half a period at most; bounds may be a body further.
                assert not period or abs(other - one) <= 0.5 * period + 2.0 * scene.radius.max()
            lines += 1
    assert lines > 10


ASKED = [(144, {}, True, False), (256, {}, False, True), (256, {"roles": ["bound"]}, False, False)]
ASKED += [(144, {"pairs": False}, False, False), (256, {"pairs": True}, True, False)]
ASKED += [(256, {"roles": ["pair"]}, True, False)]


@pytest.mark.parametrize(("bodies", "asked", "drawn", "said"), first(3, ASKED))
def test_many_pairs_are_drawn_when_they_are_asked_for(bodies, asked, drawn, said):
    sim = kt.Simulation(kt.make_scene("grid", bodies=bodies, seed=1), "sweep-tiling")
    picture = take_picture(sim, **asked)
    assert ("pair" in picture.roles, picture.caption.endswith(", without pairs (--pairs)")) == (drawn, said)


def test_a_maze_had_thousands_of_lines_between_its_walls_and_a_frame_twice_as_wide():
    mass, still, slow = [math.inf, math.inf, 1.0], (0.0, 0.0), (1.0, 0.0)
    scene = kt.Scene([(0.0, 0.0), (2.5, 0.0), (5.0, 0.5)], [still, still, slow], radius=1.0, mass=mass)
    sim = kt.Simulation(scene, "cells:side=4")
    assert sim.candidate_pairs().tolist() == [[0, 1], [0, 2], [1, 2]]
    picture = take_picture(sim)
    lines = {points_of(each) for each in picture.shapes if each.role == "pair"}
    assert lines == {((0.0, 0.0), (5.0, 0.5)), ((2.5, 0.0), (5.0, 0.5))}
    assert (picture.low, picture.high) == ((-1.0, -1.0), (6.0, 1.5))


def test_arrows_have_a_scale():
    scene = kt.Scene([(1.0, 1.0), (5.0, 1.0)], [(0.75, 0.0), (-3.0, 0.0)], 0.5, arena=(8.0, 2.0))
    root = read(as_svg(take_picture(kt.Simulation(scene, "naive")), velocities=True))
    ways = [re.match(r"M(\S+) \S+?[Lh]([\d.]+)", each.get("d")).groups() for each in root.iter(f"{SVG}path")]
    _, (a, a_tip), (b, b_tip), (_, key) = (map(float, way) for way in ways)  # the first is the head
    (speed,) = (float(each.text[6:]) for each in root.iter(f"{SVG}text") if each.text.startswith("speed "))
    assert ((a_tip - a) / key * speed, (b_tip - b) / key * speed) == pytest.approx((0.75, -3.0))


def test_it_is_drawn_on_given_axes_among_other_things():
    figure = pytest.importorskip("matplotlib.figure").Figure()
    left, right = figure.subplots(1, 2)
    sim = simulation("sap-2d")
    assert kt.plot(sim, left) is left
    assert kt.plot(sim, right, structure=True, velocities=True) is right
    assert len(left.patches) == len(sim.bodies) < len(right.patches)
    assert (left.get_xlim(), left.get_ylim()) == ((0.0, sim.scene.arena[0]), (0.0, sim.scene.arena[1]))
