"""Responses: the outcome of a contact, by kinds of bodies.

Each body has a *kind*, a name or a small whole number; the default is the first kind that the scene declares,
or else kind 0. A table gives a response by name for two kinds, or for a kind and a wall (``"wall"``); ``"*"``
means every kind. A rule for exactly the two kinds precedes a rule with one ``"*"``, which precedes ``("*",
"*")``, which does not apply to walls; contacts without a rule are elastic. One response instead of a table is
for all bodies and for the walls (``Response.for_all``). A scene declares its kinds, or they follow from its
bodies and insertions. A rule for an unknown kind is a mistake.

``elastic`` and ``pass`` are the kernel's own. ``pass`` changes no plan: the contact begins a passing, which
ends when the two part or one of them is removed; bodies cannot pass walls. All other responses are plugins
(``kinetile.plugin.specs.ResponseSpec``).
"""

from collections.abc import Iterable, Mapping, Sequence
from itertools import permutations
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from kinetile.arrays import Array, Flags, Integers
from kinetile.errors import KinetileError, Mistake, Refused, nearest, one_of
from kinetile.plugin.choices import called
from kinetile.scene.checks import (
    ANY_KIND,
    WALL_KIND,
    as_kind,
    check_name,
    is_finite,
    is_kind,
    option_mistakes,
    plain,
    shown,
)
from kinetile.scene.values import VALUES

Kind: TypeAlias = str | int
Pair: TypeAlias = tuple[Kind, Kind]

ELASTIC, PASS = "elastic", "pass"

_KIND = VALUES["kind"]
_WANTED = "the name of a response, or kinetile.Response(...)"


class Response:
    """A response by name, with its options: ``Response("restitution", e=0.9, contact_time=1e-6)``. ``found``
    is True after a check that it is registered with these options, or for a reader that runs nothing."""

    found = False

    def __init__(self, name: str, /, **options: Any) -> None:
        self.name = str.__str__(name) if isinstance(name, str) else name
        self.options: Mapping[str, Any] = plain(options)

    @property
    def one_way(self) -> tuple[float, float]:
        """The option ``one_way``: the direction from which alone an immovable body is met; or (0, 0)."""
        way: Any = self.options.get("one_way")
        fits = isinstance(way, list) and len(way) == 2 and all(map(is_finite, way))
        return (float(way[0]), float(way[1])) if fits else (0.0, 0.0)

    @property
    def passes(self) -> bool:
        """True if bodies with it may pass through each other: always, or ``one_way``; a name that is not text
        passes nothing."""
        return any(self.one_way) or (isinstance(self.name, str) and self.name == PASS)

    @property
    def for_all(self) -> "dict[Pair, Response]":
        """The rules of one response for a whole scene: all bodies, and walls unless it may pass."""
        return dict.fromkeys([(ANY_KIND, ANY_KIND), (ANY_KIND, WALL_KIND)][: 1 if self.passes else 2], self)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Response) and (self.name, self.options) == (other.name, other.options)

    def __hash__(self) -> int:
        return hash((self.name, tuple(sorted(self.options))))

    def __str__(self) -> str:
        return called(repr(self.name), self.options)  # in messages, of files as well

    def __repr__(self) -> str:
        options = "".join(f", {name}={value!r}" for name, value in sorted(self.options.items()))
        return f"Response({self.name!r}{options})"


Answer: TypeAlias = str | Response
Kinds: TypeAlias = Kind | Sequence[str] | Sequence[int] | Sequence[Kind | None] | Array
"""Kinds of bodies as an argument: one for each, None for the scene's first, or one for all."""

Responses: TypeAlias = Answer | Mapping[tuple[Any, Any], Answer] | tuple[tuple[Pair, Response], ...]
"""Responses as an argument: by pairs of kinds, one for all bodies and walls, or as a scene has them. Three
types of mappings, since a mapping has one type of keys: pairs of names, of numbers, and mixed pairs."""


class Rule(NamedTuple):
    """A response of a file, with the place of its two kinds there."""

    where: str
    between: Any
    response: Response


class SceneRules(NamedTuple):
    """Rules of a scene about ``kinds``: ``kind``, (n,), the index of each body's kind; the responses of pairs
    of kinds; ``passing``, (kinds, kinds + 1), True if two kinds pass through each other, False for walls."""

    kinds: tuple[Kind, ...]
    kind: Integers
    responses: tuple[tuple[Pair, Response], ...]
    passing: Flags


def read_rules(
    kind: Any,
    responses: Any,
    bodies: int,
    coming: Sequence[tuple[str, Any, bool]],
    mistakes: list[Mistake],
    declared: Any = None,
    complete: bool = True,
    fixed: Sequence[bool] = (),
) -> SceneRules:
    """Returns the rules of a scene about kinds; appends their mistakes.

    Args:
        kind: a kind for all bodies, or a sequence with one for each; None is the scene's first kind.
        responses: the response for each pair of kinds, or a tuple of ``Rule``.
        bodies: the number of bodies at the start.
        coming: for each insertion and each change of a kind, its place in the input, its kind (None is the
            scene's first), and True if it is an insertion.
        mistakes: a list to append mistakes to.
        declared: all kinds; None if they follow from the bodies.
        complete: True if these are all bodies; else no rule is reported as unused.
        fixed: True for bodies, and commands of ``coming``, that never meet each other; () if all meet. Rules
            for inserted bodies alone are not unused: a recording has insertions by hand.
    """
    places: dict[Pair, str] = {}
    rules = _read_responses(responses, places, mistakes)
    all_kinds = _read_declared(declared, mistakes)
    each = _read_kinds(kind, bodies, all_kinds[0] if all_kinds else 0, mistakes)
    later = [(where, as_kind(name), new) for where, name, new in coming if is_kind(name)]
    kinds = all_kinds or kinds_that_follow(each, ((name, new) for _, name, new in later), rules)
    known = dict.fromkeys(kinds)
    what = "which is none of the kinds that the scene declares"
    there = [(f"bodies[{at}].kind", name, True) for at, name in enumerate(each)] if all_kinds else []
    if not all_kinds:  # a misspelt kind of a change would be one more
        what = "the kind of no other body and of no rule (kinds=[...] declares more)"
    for where, name, _ in [*there, *later] if all_kinds or complete else ():
        if name not in known:
            mistakes.append(Mistake(where, f"{name!r}, {what}", one_of(str(name), map(str, kinds))))
            known[name] = None
    if complete:
        mistakes += _unused(rules, places, known)
    if complete and len(fixed):
        everyone = [*each, *(as_kind(name) if is_kind(name) else kinds[0] for _, name, _ in coming)]
        still = {*each} - {name for name, one in zip(everyone, fixed, strict=True) if not one}
        for pair, response in (rule for rule in rules if still.issuperset(rule[0])):
            wanted = "no rule: two immovable bodies never meet in a scene with shapes"
            mistakes.append(Mistake(places[pair], f"{response.name!r}, for immovable bodies alone", wanted))
    rows = table(kinds, rules, mistakes)
    numbers = {name: number for number, name in enumerate(kinds)}
    number = np.array([numbers.get(name, 0) for name in each], dtype=np.int64)
    return SceneRules(kinds, number, rules, np.array([[each.passes for each in row] for row in rows]))


def kinds_that_follow(
    each: Iterable[Kind], coming: Iterable[tuple[Kind, bool]], rules: Iterable[tuple[Pair, Response]]
) -> tuple[Kind, ...]:
    """Returns the kinds of a scene without declared kinds, as they appear: in bodies, or else in rules. Kinds
    in ``coming`` are of new bodies (True), or of changes, which count if a rule names them."""
    named = dict.fromkeys(name for pair, _ in rules for name in pair if is_kind(name))
    there = dict.fromkeys([*each, *(name for name, new in coming if new or name in named)])
    return tuple(there) or tuple(named) or (0,)


def no_kind(name: Any, kinds: Iterable[Kind]) -> str:
    """Returns the message that a scene has no such kind, with its kinds."""
    known = list(kinds)
    meant = nearest(name, map(str, known)) if isinstance(name, str) else None
    hint = f"; did you mean {meant!r}?" if meant else ""
    there = f"; there are: {', '.join(map(repr, known))}"
    if not {*known} - {0, WALL_KIND}:
        there = ", which has none: kind=[...], or kind in [[bodies]], gives kinds to bodies"
    return f"{shown(name)} is no kind of this scene{there}{hint}"


def find_kind(value: Any, kinds: Sequence[Kind], where: str, told: Sequence[Kind] | None = None) -> Kind:
    """Returns the kind that a value of any class equals; True and False are not kinds. ValueError for a value
    that equals no kind, with its place, and with the kinds in ``told``."""
    plain = value.item() if isinstance(value, np.generic | np.ndarray) and value.ndim == 0 else value
    try:
        found = None if isinstance(plain, bool) else dict(zip(kinds, kinds, strict=True)).get(plain)
    except TypeError:  # it has no hash
        found = None
    if found is None:
        raise ValueError(f"{where}: {no_kind(value, told or kinds)}")
    return found


def _unusable(where: str, response: Response) -> list[Mistake]:
    """Returns the mistake of a response that no plugin provides, or the mistakes of its options; without any,
    marks it as found: then processes without its plugin can read the scene."""
    if not isinstance(response.name, str):
        return [Mistake(where, shown(response), _WANTED)]
    if response.found or (response.name in (ELASTIC, PASS) and not response.options):
        return []
    wrong = check_name(where, response.name, "response")
    wrong = wrong or option_mistakes(response.name, response.options, f"{where}.options", "response")
    response.found = not wrong
    return wrong


def _unused(
    rules: Iterable[tuple[Pair, Response]], places: Mapping[Pair, str], known: Mapping[Kind, Any]
) -> list[Mistake]:
    """Returns the rules that would never apply: no body and no insertion is of their kind."""
    mistakes = []
    for pair, _ in rules:
        for name in dict.fromkeys(pair):
            if is_kind(name) and name not in known:
                message = f"{name!r}, a kind that no body has"
                kinds = one_of(str(name), map(str, known))
                if tuple(known) == (0,):
                    kinds = "0, the kind of bodies that are given none"
                wanted = f"{kinds} (kinds=[...] declares those whose bodies come by hand)"
                mistakes.append(Mistake(places[pair], message, wanted))
    return mistakes


def _read_declared(given: Any, mistakes: list[Mistake]) -> tuple[Kind, ...]:
    if given is None:
        return ()
    try:
        names = None if isinstance(given, str) else list(given)
    except TypeError:
        names = None
    if names is None:
        mistakes.append(Mistake("kinds", shown(given), "all kinds of bodies, such as ['ball', 'sensor']"))
        return ()
    for number, name in enumerate(names):
        mistakes += _KIND.mistakes(name, f"kinds[{number}]")
    return tuple(dict.fromkeys(as_kind(name) for name in names if is_kind(name)))


def _read_kinds(given: Any, bodies: int, first: Kind, mistakes: list[Mistake]) -> list[Kind]:
    if given is None:
        return [first] * bodies
    if isinstance(given, str | int | np.integer):
        each: list[Any] = [given] * bodies
    else:
        try:
            each = list(given)
        except TypeError:
            each = [given]
    if len(each) != bodies:
        message = f"{len(each)} {'kind' if len(each) == 1 else 'kinds'}"
        mistakes.append(Mistake("kind", message, f"one for each of the {bodies} bodies, or one for all"))
        each = [first] * bodies
    for number, name in enumerate(each):
        if not is_kind(name):
            if name is not None:
                mistakes += _KIND.mistakes(name, f"bodies[{number}].kind")
            each[number] = first
    return [as_kind(name) for name in each]


def _read_responses(
    given: Any, places: dict[Pair, str], mistakes: list[Mistake]
) -> tuple[tuple[Pair, Response], ...]:
    """Returns the rules of a table, kinds in one order, sorted; adds places, and appends mistakes."""
    if given is None:
        return ()
    if isinstance(given, str | Response):
        one = Response(given) if isinstance(given, str) else given
        mistakes += _unusable("responses", one)
        return tuple(one.for_all.items())
    if isinstance(given, tuple) and all(isinstance(rule, tuple) and len(rule) == 2 for rule in given):
        given = dict(given)  # as a scene has them
    of_a_file = isinstance(given, tuple) and all(isinstance(rule, Rule) for rule in given)
    if not (of_a_file or isinstance(given, Mapping)):
        wanted = "a mapping from two kinds to a response, such as {('ball', 'sensor'): 'pass'}"
        mistakes.append(Mistake("responses", shown(given), wanted))
        return ()
    rules: dict[Pair, Response] = {}
    written = given if of_a_file else (Rule(f"responses[{shown(each)}]", each, given[each]) for each in given)
    for where, between, what in written:
        pair = between if isinstance(between, tuple | list) and len(between) == 2 else ()
        named = sum(each == WALL_KIND for each in pair)
        if not pair or named > 1 or not all(is_kind(each) or each in (WALL_KIND, ANY_KIND) for each in pair):
            wanted = f"two kinds, or one and {WALL_KIND!r}; {ANY_KIND!r} for any"
            mistakes.append(Mistake(where, shown(between), wanted))
            continue
        response = Response(what) if isinstance(what, str) else what
        if not isinstance(response, Response):
            mistakes.append(Mistake(where, shown(what), _WANTED))
        elif response.passes and WALL_KIND in pair:
            mistakes.append(Mistake(where, str(response), "another response: walls cannot be passed"))
        else:
            mistakes += _unusable(where, response)
            ordered = _ordered(as_kind(pair[0]), as_kind(pair[1]))
            places.setdefault(ordered, where)
            if rules.setdefault(ordered, response) != response:
                wanted = f"one response, and {rules[ordered]} is another"
                mistakes.append(Mistake(where, str(response), wanted))
    return tuple(sorted(rules.items(), key=lambda rule: [_order(each) for each in rule[0]]))


def _order(kind: Kind) -> tuple[bool, bool, bool, int, str]:
    """Returns the sort key of a kind in a pair: whole numbers, names, "*", "wall"."""
    text = isinstance(kind, str)
    return kind == WALL_KIND, kind == ANY_KIND, text, 0 if text else int(kind), str(kind) if text else ""


def _ordered(a: Kind, b: Kind) -> Pair:
    return (a, b) if _order(a) <= _order(b) else (b, a)


def refusals(scene: Any) -> list[Mistake]:
    """Returns the refusals of a scene by its responses, except responses that are not installed here."""
    found: dict[str, Mistake] = {}
    for pair, response in scene.responses:
        if response.name not in (ELASTIC, PASS):
            from kinetile.plugin.calling import calling
            from kinetile.plugin.registry import registry

            try:
                with calling("response", response.name, "prepare"):
                    registry().target("response", response.name)(**response.options).prepare(scene)
            except Refused as error:
                mistake = Mistake(f"responses[{pair!r}]", str(response), str(error))
                found.setdefault(repr(response), mistake)
            except KinetileError:  # a run raises it
                continue
    return [*found.values()]


def settles(response: Response) -> bool:
    """Returns True if a response lets bodies settle on a support: it has an option ``settle``."""
    return response.options.get("settle") is not None


def table(
    kinds: Sequence[Kind], rules: Iterable[tuple[Pair, Response]], mistakes: list[Mistake] | None = None
) -> list[list[Response]]:
    """Returns the response of each two kinds, and of a kind and a wall (last); appends rules in conflict."""
    message = dict(rules)
    elastic = Response(ELASTIC)
    usual, walls = message.get((ANY_KIND, ANY_KIND), elastic), message.get((ANY_KIND, WALL_KIND), elastic)
    own = [message.get(_ordered(each, ANY_KIND)) for each in kinds]
    rows = [[a or b or usual for b in own] + [walls] for a in own]  # with 256 kinds these are 65,000
    place = {kind: at for at, kind in enumerate(kinds)} | {WALL_KIND: len(kinds)}
    for (a, b), response in message.items():
        if a in place and b in place:
            rows[place[a]][place[b]] = response
            if b != WALL_KIND:
                rows[place[b]][place[a]] = response
    if mistakes is not None:
        some = [(kind, response) for kind, response in zip(kinds, own, strict=True) if response]
        for (a, one), (b, two) in permutations(some, 2):
            if one != two and (a, b) not in message and _order(a) < _order(b):
                where, what = f"responses[{(a, b)!r}]", f"nothing, {one} and {two} by their kinds"
                mistakes.append(Mistake(where, what, "a response for these two"))
    return rows
