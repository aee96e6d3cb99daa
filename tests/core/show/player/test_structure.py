"""The structure in the page is the phase's own: its drawing at a moment is ``drawing``'s result."""

import numpy as np

import kinetile as kt
from kinetile.plugin.drawing import Box, Entry, Link
from kinetile.show.player import recording, view_scene
from kinetile.show.player.page import encode
from player_pages import SCENES, decode


def test_a_shape_that_stays_is_written_once():
    log = recording.StructureLog()
    link, other = Link("pair", 0, 1), Link("pair", 0, 2)
    for done, items in enumerate([[link], [link], [link, other], [other], [link]]):
        log.see(done, items)
    columns = log.columns()
    assert columns is not None
    spans = zip(
        columns["first"].tolist(), columns["last"].tolist(), columns["body"][2::4].tolist(), strict=True
    )
    assert list(spans) == [(0, 3, 1), (2, 4, 2), (4, 5, 1)]
    again = decode(encode(columns))
    assert all(again[name].tobytes() == columns[name].tobytes() for name in columns)


def test_too_much_of_it_is_said(monkeypatch):
    monkeypatch.setattr(recording, "MOST_LOOKS", 100)
    page = view_scene(SCENES["grid"], [("naive", {})], until=0.3).page
    most = "The structure is recorded up to event 0; after it, there is too much of it for a page."
    assert page.all_notes == [most]


def test_the_matrix_of_two_axes_has_the_pairs_where_both_overlap():
    scene = kt.make_scene("random", bodies=24, density=0.3, radius_ratio=4.0, seed=4)
    sim = kt.Simulation(scene, "sap-2d")
    for until in (0.0, 0.2, 0.5):
        sim.run(until)
        items = sim.drawing()
        entries = {(item.a, item.b): item for item in items if isinstance(item, Entry)}
        assert {pair for pair, item in entries.items() if item.label == "both"} == {
            (item.a, item.b) for item in items if isinstance(item, Link)
        }
        reach, at = scene.radius, sim.positions()
        for a in range(24):
            for b in range(a + 1, 24):
                x, y = np.abs(at[a] - at[b]) < reach[a] + reach[b]
                label = "both" if x and y else "x" if x else "y" if y else None
                assert (entries[a, b].label if (a, b) in entries else None) == label


def test_what_is_only_scheduled_again_is_not_fresh():
    log = recording.StructureLog()
    tile, later = Box("tile", (0.0, 0.0), (1.0, 1.0), 5), Box("tile", (0.0, 0.0), (1.0, 1.0), 9)
    log.see(0, [tile, Entry("bound", 0, 1, label="x")])
    log.see(1, [later, Link("pair", 0, 1), Entry("pair", 0, 1, label="both")])
    columns = log.columns()
    assert columns is not None
    come = columns["first"] == 1
    shapes = [recording.DRAWN[number].__name__ for number in columns["shape"][come]]
    found = dict(zip(shapes, columns["fresh"][come].tolist(), strict=True))
    assert found == {"Box": 0, "Link": 1, "Entry": 1}
