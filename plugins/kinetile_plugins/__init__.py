"""The built-in phases and scenes, registered as by any plugin.

This module only lists them with their targets; a phase's own module is imported when it is selected.
"""

from kinetile.plugin.specs import BroadPhaseSpec, NarrowPhaseSpec, ResponseSpec, SceneSpec, hookimpl


@hookimpl
def kinetile_broad_phases() -> list[BroadPhaseSpec]:
    """Lists the built-in broad phases."""
    return [
        BroadPhaseSpec(
            "naive",
            "kinetile_plugins.naive:Naive",
            "every pair is a candidate, always: no certificates, n(n-1)/2 pairs",
        ),
        BroadPhaseSpec(
            "cells",
            "kinetile_plugins.cells:Cells",
            "a uniform grid, hierarchical where sizes differ: bodies in adjoining cells",
            aliases=("uniform-grid",),
        ),
        BroadPhaseSpec(
            "sap-1d",
            "kinetile_plugins.sweep_and_prune:SweepAndPrune",
            "sweep and prune: bounds kept sorted along one axis, or along a slanted line",
            aliases=("sweep-and-prune",),
        ),
        BroadPhaseSpec(
            "sap-2d",
            "kinetile_plugins.sweep_and_prune:SweepAndPruneBoxes",
            "sweep and prune on both axes: a pair is a candidate where both intervals overlap",
            features=frozenset({"boxes"}),
            aliases=("sweep-and-prune-matrix",),
        ),
        BroadPhaseSpec(
            "sap-k",
            "kinetile_plugins.sweep_and_prune:SweepAndPruneMany",
            "sweep and prune along k lines: a pair is a candidate where all k intervals overlap",
        ),
        BroadPhaseSpec(
            "sweep-tiling",
            "kinetile_plugins.sweep_tiling:SweepTiling",
            "the free space in tiles: pairs of bodies that see each other, O(n) of them",
            aliases=("tiling",),
        ),
        BroadPhaseSpec(
            "power",
            "kinetile_plugins.power:Power",
            "a kinetic regular triangulation: pairs of bodies with an edge, O(n) of them, few events",
        ),
    ]


@hookimpl
def kinetile_narrow_phases() -> list[NarrowPhaseSpec]:
    """Lists the built-in narrow phases."""
    return [
        NarrowPhaseSpec("disc", "kinetile_plugins.disc:Disc", "disc against disc, elastic", role="pair"),
        NarrowPhaseSpec(
            "convex",
            "kinetile_plugins.convex:Convex",
            "convex bodies that do not rotate, elastic",
            role="pair",
            shapes=("disc", "capsule", "box", "polygon", "segment"),
        ),
        NarrowPhaseSpec(
            "wall", "kinetile_plugins.wall:Wall", "a body against the arena's walls, elastic", role="wall"
        ),
    ]


@hookimpl
def kinetile_responses() -> list[ResponseSpec]:
    """Lists the built-in responses."""
    module = "kinetile_plugins.responses"
    return [
        ResponseSpec("elastic", f"{module}:Elastic", "what the narrow phases do: nothing is lost"),
        ResponseSpec("pass", f"{module}:Pass", "nothing changes: begin and end of a passing"),
        ResponseSpec(
            "restitution",
            f"{module}:Restitution",
            "a share e of the closing speed comes back",
            frozenset({"dissipative"}),
        ),
        ResponseSpec("stop", f"{module}:Stop", "both come to rest", frozenset({"dissipative"})),
    ]


@hookimpl
def kinetile_scenes() -> list[SceneSpec]:
    """Lists the built-in scene recipes."""
    recipes = (
        ("grid", "random_discs:grid", "the thesis's benchmark: discs started on a grid"),
        ("random", "random_discs:random_discs", "discs of random radii, nowhere overlapping"),
        ("lattice", "lattice:lattice", "dyadic numbers: exact ties and touching starts"),
        ("figure-10", "arranged:figure_10", "every pair overlaps along an axis (figure 10)"),
        ("figure-11", "arranged:figure_11", "every pair of bounding boxes overlaps (figure 11)"),
        ("figure-16", "arranged:figure_16", "one disc is every other's neighbour (figure 16)"),
        ("cradle", "arranged:cradle", "a row of touching discs, struck at one end"),
        ("break", "arranged:billiard_break", "a billiard break"),
        ("two-discs", "arranged:two_discs", "two discs that meet"),
        ("mixture", "matter:mixture", "discs of two and more sizes, at a temperature"),
        ("grown", "grown:grown", "a dense mixture: discs that grew while they moved"),
        ("hexagonal", "matter:hexagonal", "a hexagonal crystal of equal discs"),
        ("square", "matter:square", "a square crystal of equal discs"),
        ("galton", "galton:galton", "Galton's board: balls fall among pegs"),
        ("heap", "heap:heap", "discs lie on each other in a box"),
        ("frame", "frame:frame", "a frame of an extended XYZ or GSD file"),
    )
    return [SceneSpec(name, f"kinetile_plugins.scenes.{path}", summary) for name, path, summary in recipes]
