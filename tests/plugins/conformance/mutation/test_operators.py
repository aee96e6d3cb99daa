"""What is changed, what is not, and that the spans are exact."""

from __future__ import annotations

import ast
import textwrap
from pathlib import Path

import pytest

from kinetile_conformance.mutation.mutants import PhaseSource, Source, mutants_of, reached, sample, source_of
from kinetile_conformance.mutation.operators import OPERATORS


def phase(text: str) -> PhaseSource:
    """Return a phase of one module, whose class is ``It`` and reaches all."""
    source = Source("it", Path("it.py"), textwrap.dedent(text))
    return PhaseSource("it:It", reached(source, "", "It"))


def changes(expression: str) -> set[str]:
    """Return what becomes of ``expression`` in a hook, in all mutants."""
    source = f"def f(k, s, a, b, c, n):\n    r = {expression}\n    return r.it\nclass It:\n    f = f\n"
    lines = (mutant.after[0] for mutant in mutants_of(phase(source)))
    return {line.removeprefix("    r = ") for line in lines}


@pytest.mark.parametrize(
    ("expression", "expected"),
    [
        ("a < b", {"a <= b"}),
        ("a <= b", {"a < b"}),
        ("a > b", {"a >= b"}),
        ("a >= b", {"a > b"}),
        ("a == b", {"a != b"}),
        ("a != b", {"a == b"}),
        ("(a) < (b)", {"(a) <= (b)"}),
        ("a < b <= c", {"a <= b <= c", "a < b < c"}),
        ("a + b", {"a - b"}),
        ("a - (b - c)", {"a + (b - c)", "a - (b + c)"}),
        ("-(a)", {"(a)"}),
        ("a and b", {"a or b"}),
        ("a and (b or c)", {"a or (b or c)", "a and (b and c)"}),
        ("not a", {"a"}),
        ("a & b", {"a | b"}),
        ("k.bodies[a].reach", {"k.bodies[a].radius", "k.bodies[a + 1].reach"}),
        ("scene.radius", set()),
        ("a.radius", {"a.reach"}),
        ("np.floor(a)", {"np.trunc(a)"}),
        ("math.floor(a)", {"math.trunc(a)"}),
        ("a // b", {"int((a) / (b))"}),
        ("s.after[n]", {"s.after[n + 1]"}),
        ("s.place[a, b]", {"s.place[a + 1, b]", "s.place[a, b + 1]"}),
        ("s.place[a:, b]", {"s.place[a:, b + 1]"}),
        ("s.place[n - 2]", {"s.place[n + 2]", "s.place[n - 1]"}),
        ("s['x']", set()),
        ("min(a, b)", {"max(a, b)"}),
        ("a.max()", {"a.min()"}),
        ("4", {"3"}),
        ("0", {"1"}),
        ("2.0", {"1.0"}),
        ("0.5", set()),
        ("True", {"False"}),
        ("a.vx", {"a.vy"}),
        ("k.clock[0].limits.width", {"k.clock[0].limits.height", "k.clock[1].limits.width"}),
        ("s.width", set()),
        ("b if a else c", {"b if True else c", "b if False else c"}),
        ("f'{a + b}'", set()),
    ],
)
def test_an_expression_and_all_that_becomes_of_it(expression, expected):
    assert changes(expression) == expected


def test_statements():
    source = """
        def f(k, s, body, n) -> int:
            schedule(k, body, n)
            s.after[body] = n
            n += body
            if n:
                n = f(k, s,
                      body, n)
            return n

        class It:
            def prepare(self, scene):
                return BroadPhaseParts(f, n, replan=f, audit=f, ticks=(n,))
    """
    found = {mutant.label: mutant for mutant in mutants_of(phase(source))}
    assert list(found) == [
        "it.py:3 dropped schedule(...)",
        "it.py:4 dropped s.after[body] = ...",
        "it.py:4 index [body] + 1",
        "it.py:5 sign += -> -=",
        "it.py:6 condition always true",
        "it.py:6 condition always false",
        "it.py:9 count return n -> n - 1",
        "it.py:13 dropped replan=...",
        "it.py:13 dropped ticks=...",
    ]
    assert [mutant.number for mutant in found.values()] == list(range(1, 10))
    dropped = found["it.py:3 dropped schedule(...)"]
    assert (dropped.before, dropped.after) == (["    schedule(k, body, n)"], ["    pass"])
    assert found["it.py:9 count return n -> n - 1"].after == ["    return (n) - 1"]
    assert found["it.py:13 dropped replan=..."].after == [
        "        return BroadPhaseParts(f, n,  audit=f, ticks=(n,))",
    ]


def test_a_name_that_is_not_there_is_brought_along():
    source = "def f(a, b):\n    return smaller(a, b)\nclass It:\n    f = f\n"
    (mutant,) = mutants_of(phase(source))
    assert mutant.text.endswith("\n\nfrom kinetile.toolbox import larger\n")


def test_columns_are_bytes_and_lines_may_be_many():
    source = "def f(a, b):\n    r = 'äöü' if a.x else (a.vx\n        <  b)\n    return r.it\n"
    source += "class It:\n    f = f\n"
    found = {mutant.label: mutant.after for mutant in mutants_of(phase(source))}
    assert found["it.py:3 comparison < -> <="] == ["        <=  b)"]
    assert found["it.py:2 name vx -> vy"] == ["    r = 'äöü' if a.x else (a.vy"]
    for mutant in mutants_of(phase(source)):
        ast.parse(mutant.text)


def test_what_is_left_alone():
    source = '''
        """Head: 1 + 1."""
        __all__ = ["It"]
        Kind = tuple[int, int]

        def unused(a):
            return a + 1

        def judge(k, s):
            yield helper(k) + 1

        def helper(k):
            return k + 1

        def show(k, s):
            yield k + 1

        class State(NamedTuple):
            """1 + 1."""
            place: Records[1]  # (n, 2)

        @hook(1)
        def f(a: tuple[int, 1], b: int = State) -> None:
            """1 + 1."""
            assert a < b, 3
            b.it(a - b)  # mutate: equivalent, because nobody looks

        class It(Base[1]):
            def prepare(self, scene: Kind):
                if scene.width < 0:
                    raise ValueError(f"{scene.width - 1}")
                return BroadPhaseParts(f, State(), audit=judge, draw=show)
    '''
    assert mutants_of(phase(source)) == []


def test_a_sample_is_drawn_by_lot_and_the_same_again():
    every = mutants_of(source_of("sap-1d"))
    ten = sample(every, 10, seed=1)
    assert len({mutant.number for mutant in ten}) == 10
    assert ten == sample(every, 10, seed=1) != sample(every, 10, seed=2)
    assert ten == sorted(ten, key=lambda mutant: mutant.number)
    only = sample(every, None, only="dropped schedule")
    assert [mutant.label.partition(":")[0] for mutant in only] == ["sweep_and_prune.py", "circular_bounds.py"]


@pytest.mark.parametrize("name", ["naive", "cells", "sap-1d", "sap-2d", "sweep-tiling"])
def test_every_mutant_of_a_built_in_phase_is_another_program(name):
    every = mutants_of(source_of(name))
    assert len({mutant.label for mutant in every}) == len(every)
    for mutant in sample(every, 40):
        assert ast.dump(ast.parse(mutant.text)) != ast.dump(mutant.source.tree), mutant.label
        assert mutant.before != mutant.after


def test_every_operator_is_at_work_in_some_built_in_phase():
    kinds = {m.change.operator for name in ("cells", "sap-1d") for m in mutants_of(source_of(name))}
    assert kinds == set(OPERATORS)
