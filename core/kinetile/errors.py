"""Every error that kinetile raises: whole sentences that name the fault, its place, and a right value.

For an unknown name such a sentence has the nearest known name. Edit distance alone misses short forms ("sap"
for "sap-1d"): so case is ignored, ``_`` equals ``-``, and a beginning matches if only one name has it.
"""

import inspect
import os
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import is_dataclass
from difflib import get_close_matches
from functools import cache, wraps
from types import ModuleType, UnionType
from typing import Any, ClassVar, NamedTuple, ParamSpec, TypeVar, Union, get_args, get_origin, get_type_hints

__all__ = [
    "AuditError",
    "BadOption",
    "BadPlugin",
    "BusyError",
    "DuplicateName",
    "KinetileError",
    "MissedContactError",
    "MissingExtra",
    "Mistake",
    "NoRoom",
    "NotJudged",
    "PhaseError",
    "PluginApiMismatch",
    "RecordError",
    "Refused",
    "SceneError",
    "StalledError",
    "StudyError",
    "TooThick",
    "UnawaitedContactError",
    "UnknownName",
    "ZenoError",
    "key_of",
    "legible",
    "nearest",
    "one_of",
    "printable",
    "shown",
]

_Arguments = ParamSpec("_Arguments")
_Result = TypeVar("_Result")
_Class = TypeVar("_Class")

_LONGEST_NAME = 100
_LONGEST_LINE = 10_000


class KinetileError(Exception):
    """The base of every error that kinetile raises on purpose.

    It can be copied and pickled, with any constructor, so that it leaves a worker process
    unchanged. Its message is safe for a terminal, even with text from a file.
    """

    def __init__(self, *args: object) -> None:
        super().__init__(*(legible(each, _LONGEST_LINE) if isinstance(each, str) else each for each in args))

    def __reduce__(self) -> tuple[Any, ...]:
        return _as_raised, (type(self), self.args, self.__dict__)


class UnknownName(KinetileError, LookupError):
    """No phase or scene is registered under this name."""

    def __init__(
        self,
        kind: str,
        name: str,
        *,
        suggestion: str | None = None,
        available: Sequence[str] = (),
        failures: Sequence[Any] = (),
        other: str | None = None,
    ) -> None:
        self.kind = kind
        self.name = name
        self.suggestion = suggestion
        self.available = tuple(available)
        self.failures = tuple(map(str, failures))  # as text: exceptions of plugins may hold anything
        meant = f"; did you mean {suggestion!r}?" if suggestion else "."
        meant = f": it is a {other}." if other else meant
        if kind == "scene" and str(name).endswith(".toml"):
            meant = f": kinetile.load_scene({name!r}), or `kinetile run {name}`, reads a file."
        lines = [
            f"no {kind} is called {shown(name, 1000)}{meant}",
            f"available: {', '.join(self.available) or 'none'}",
        ]
        lines += [f"not loaded: {failure}" for failure in self.failures]
        super().__init__("\n".join(lines))


class DuplicateName(KinetileError, ValueError):
    """Two plugins claim one name."""


class PluginApiMismatch(KinetileError, ValueError):
    """A plugin was written for another version of the plugin API."""


class BadOption(KinetileError, TypeError):
    """A phase or a recipe was given an option that it does not have, or a value that it cannot use."""


class Mistake(NamedTuple):
    """One mistake in a scene: its place, the value found, and the values allowed."""

    where: str
    found: str
    expected: str

    def __str__(self) -> str:
        lines = (line.strip().removesuffix(".") for line in self.expected.split("\n"))  # of another error
        where, found, expected = map(printable, (self.where, self.found, "; ".join(lines)))
        return f"{where}: found {found}; expected {expected}"


class _Mistaken(KinetileError, ValueError):
    """Mistakes in a user's input: a subclass gives ``what``, its noun; ``source`` is its file, or None."""

    what: ClassVar[str]

    def __init__(self, mistakes: Sequence[Mistake], source: str | None = None) -> None:
        self.mistakes = tuple(mistakes)
        self.source = source
        count = f"{len(mistakes)} mistake{'s' if len(mistakes) != 1 else ''}"
        head = f"{printable(source)}: {count}" if source else f"{self.what} has {count}"
        super().__init__("\n".join([head, *(f"  {mistake}" for mistake in mistakes)]))


class SceneError(_Mistaken):
    """A scene is not fit to be simulated; all of its mistakes are listed at once."""

    what = "the scene"


class StudyError(_Mistaken):
    """A study cannot be run as its file says; all of its mistakes are listed at once."""

    what = "the study"


class Refused(KinetileError, ValueError):
    """A phase does not accept this scene; the message gives the reason and names phases that do."""


class NoRoom(Refused):
    """A body that is to be inserted has no room. The message is made at its first reading."""

    def __str__(self) -> str:
        if callable(self.args[0]):
            self.args = (legible(self.args[0](), _LONGEST_LINE),)
        return str(self.args[0])

    def __repr__(self) -> str:
        return f"NoRoom({str(self)!r})"

    def __reduce__(self) -> tuple[Any, ...]:
        str(self)  # another process cannot make its text
        return super().__reduce__()


class TooThick(Refused):
    """A broad phase is right only with a thinner skin than the bodies need, by their number, distance and
    speed. It may end a run: at a command, or because bodies fly away. Nothing has changed then, and another
    try ends in the same way."""


class _OfBodies(KinetileError, RuntimeError):
    def __init__(self, message: str, *, time: float, bodies: Sequence[int]) -> None:
        self.time = time
        self.bodies = tuple(bodies)
        super().__init__(message)


class ZenoError(_OfBodies):
    """Contacts follow each other without end at one time: the bodies are jammed."""


class MissedContactError(_OfBodies):
    """A contact was missed: two bodies overlap more than rounding explains, or were reported too late."""


class PhaseError(KinetileError, RuntimeError):
    """A phase or a response broke the protocol; the message names it and the fault."""


class BusyError(KinetileError, RuntimeError):
    """A call would change a simulation during a run: from its own recorder, or from another thread."""


class StalledError(PhaseError):
    """A phase makes no progress: its certificates fail again and again at the same moment."""


class NotJudged(KinetileError, RuntimeError):
    """A broad phase cannot be judged: it does not load, or its hooks do not compile."""


class MissingExtra(KinetileError, ImportError):
    """An optional dependency is not installed; the message names the extra that brings it."""

    def __init__(self, purpose: str, package: str, extra: str) -> None:
        super().__init__(
            f"{purpose} needs {package}, which is not installed; "
            f"install it with: pip install 'kinetile[{extra}]'"
        )


class BadPlugin(KinetileError, TypeError):
    """A plugin's hooks, or the specs that they return, are invalid."""


class RecordError(KinetileError, OSError):
    """An event file cannot be written or read; the message names the kept part."""


class AuditError(KinetileError, AssertionError):
    """An audit found a violation; the message names it and the moment."""


class UnawaitedContactError(MissedContactError, AuditError):
    """An audit found a contact that is not predicted, or predicted too late: it would be missed."""


FAULTS = (ZenoError, MissedContactError, PhaseError, AuditError)
"""Errors that end a run of an accepted scene under accepted phases."""


def nearest(name: str, known: Iterable[str]) -> str | None:
    """Returns the known name that ``name`` probably means, or None if no known name is near."""
    if len(name) > _LONGEST_NAME:
        return None
    folded, wanted = {_fold(each): each for each in known}, _fold(name)
    begun = [each for each in folded if wanted and each.startswith(wanted)]
    written = _WORDS.get(wanted, ("", "", ""))[1]
    alike = [each for each in folded if each[:3] == wanted[:3]]  # body and bodies; but not energy and near
    close = get_close_matches(wanted, folded, n=1, cutoff=0.7) or get_close_matches(wanted, alike, n=1)
    likely = [wanted, *(begun if len(begun) == 1 else []), written, *close]
    return next((folded[each] for each in likely if each in folded), None)


def legible(text: str, longest: int | None = None) -> str:
    """Returns a text of one line or several, safe for a terminal or a page: control characters and marks of
    direction are escaped, and longer lines are cut. Results hold text of files and of other programs."""
    return "\n".join(printable(line, longest or len(line)) for line in text.split("\n"))


def printable(text: str, most: int = 1000) -> str:
    """Returns ``text`` safe for a terminal: control characters escaped, and cut if it is too long."""
    if len(text) > most:
        text = f"{text[: most - 3]}..."
    return text if text.isprintable() else "".join(c if c.isprintable() else repr(c)[1:-1] for c in text)


def shown(value: object, width: int = 60) -> str:
    """Returns ``value`` as messages quote it: numbers without their NumPy type, and not too long."""
    numpy = sys.modules.get("numpy")
    if numpy is not None and isinstance(value, numpy.generic):
        value = value.item()
    try:
        text = repr(value)
    except ValueError:
        text = "a whole number of too many digits to be shown"
    return text if len(text) <= width else f"{text[: width - 3]}..."


def one_of(name: str, known: Iterable[str]) -> str:
    """Returns the text after "expected" for a ``name`` that is not one of the known names."""
    names = list(known)
    if not names:
        return "nothing here"
    choice = printable(f"one of {', '.join(names)}", 300) if len(names) > 1 else names[0]
    meant = nearest(name, names)
    return f"{choice}; did you mean {meant!r}?" if meant else choice


_WRITTEN = {
    "position = [x, y]": "pos place location center centre coordinates x y",
    "velocity = [vx, vy]": "vel speed direction heading v vx vy",
    "radius = half of it": "diameter diam",
    "radius = half of it, or a shape with width and height": "size width height",
    "radius": "r",
    "mass": "weight m",
    "mass = inf: it keeps its velocity, whatever it meets": "static fixed immovable kinematic frozen pinned",
    "mass = density times area": "density rho",
    "responses: for two kinds restitution, with e": "bounce bounciness elasticity restitution",
    "responses: for two kinds pass": "sensor trigger ghost",
    "kind": "type species group layer category tag label",
    "arena = [width, height]": "walls bounds bounding-box box world domain",
    'periodic = "x", "y" or "xy"': "torus wrap pbc boundary",
    "gravity = [gx, gy]": "gravity g acceleration",
    "until, the time of the end": "duration end-time stop-time",
    "corners, anticlockwise": "vertices points outline",
    "disc": "circle ball sphere",
    "box": "rect rectangle square",
    "segment": "line edge",
}
"""Texts of kinetile, and other programs' words for them; for places that have the text's first word."""

_NOT_MODELLED = {
    "bodies are moved by gravity, contacts and commands alone": "force forces",
    "bodies do not rotate; a box at an angle is a polygon": "angle rotation orientation angular-velocity "
    "angular-momentum omega spin torque inertia theta",
    "contacts act along their normal alone": "friction mu roughness",
    "bodies keep their velocity between contacts": "drag damping linear-damping viscosity",
    "bodies act on each other by contacts alone": "joint joints spring springs bonds constraints",
    "each event has its exact time, and there are no steps; run(duration=dt) runs for dt": "dt "
    "timestep time-step substeps",
}

_WORDS = {
    word: (begins, text.split(maxsplit=1)[0].rstrip(",:") if begins == "write" else "", text)
    for begins, table in (("write", _WRITTEN), ("not modelled", _NOT_MODELLED))
    for text, words in table.items()
    for word in words.split()
}


_INSTEAD = {
    "kinetile.load_scene(path) for a scene, kinetile.resume(path) for a saved simulation, "
    "kinetile.read_events(path) for an event file": "load loads read open read-scene from-file",
    "kinetile.save_scene(scene, path), or sim.save(path)": "save dump write to-file",
    "sim = kinetile.Simulation(scene), then sim.run(until=...)": "simulate simulator simulation world space "
    "engine system",
    "kinetile.Scene(position, velocity, radius), which has a row for each body": "body bodies particle "
    "particles",
    "sim.run(until=...)": "run advance update evolve integrate solve step-until",
    "sim.remove(body), then sim.insert(position, velocity, radius), which returns its new number": (
        "set-radius set-mass set-shape"
    ),
    "sim.set_position(body, position)": "set-positions set-pos move move-to teleport translate",
    "sim.set_kind(body, kind)": "set-filter set-group set-category set-layer set-type",
    "sim.set_velocity(body, velocity)": "apply-impulse impulse kick push set-speed accelerate",
    "sim.insert(position, velocity, radius)": "add add-body add-disc add-circle add-particle spawn create",
    "sim.remove(body)": "delete destroy kill discard pop",
    "sim.contacts": "collisions hits get-contacts",
    "len(scene), or len(sim.bodies)": "n count num-bodies size",
    "kinetile.view(sim), or kinetile.as_svg(sim)": "plot show render display animate",
    "sim.run(until=..., observe=[its name]), then sim.observed[its name]": "energy temperature pressure "
    "momentum msd vacf rates",
}
"""Kinetile's text, and the attributes of other programs for it."""

_MEANT = {word: text for text, words in _INSTEAD.items() for word in words.split()}


def no_attribute(owner: object, name: str) -> AttributeError:
    """Returns the error of an attribute that ``owner``, a package or an object, does not have: with
    kinetile's text for it, or the nearest name."""
    if inspect.getattr_static(type(owner), name, None) is not None:  # a property that has raised one itself
        try:
            object.__getattribute__(owner, name)
        except AttributeError as error:
            return error
    what = f"{type(owner).__name__!r} object"
    if isinstance(owner, ModuleType):
        what = f"module {owner.__name__!r}"
    text = f"{what} has no attribute {name!r}"
    if name.startswith("_"):
        return AttributeError(text)
    meant, near = _MEANT.get(_fold(name)), nearest(name, (each for each in dir(owner) if each[0] != "_"))
    hint = f"; write instead: {meant}" if meant else f"; did you mean {near!r}?" if near else ""
    if not hint and (word := _WORDS.get(_fold(name), ("", "", "")))[0] == "not modelled":
        hint = f"; {name!r} is not modelled: {word[2]}"
    return AttributeError(text + hint)


def key_of(name: str, known: Iterable[str], value: Any = None, call: Callable[..., Any] | None = None) -> str:
    """Returns the text after "expected" for a key or an argument that is unknown in its place. For words of
    other programs, such as force and diameter, the text has kinetile's word, or says that it does not model
    this. If ``value`` is a table, the right keys are inside of it. For an argument of a ``call``, the text
    has words of scenes only if the call takes a scene, or bodies."""
    names, word = list(known), _fold(name)
    if isinstance(value, Mapping) and names:
        return f"{one_of('', names)}, without a table around"
    begins, target, text = _WORDS.get(word, ("", "", ""))
    if call is not None and (place := _within(call, name)):
        return place
    elsewhere = begins == "write" and call is not None and {target, "scene", "position"}.isdisjoint(names)
    if not begins or elsewhere or any(_fold(each).startswith(word) for each in names):
        return one_of(name, names)
    where = "" if target in names else " in a scene"
    head = f"for {name!r}{where} write" if begins == "write" else f"{name!r} is not modelled:"
    return f"{one_of('', names)}; {head} {text}"


def answering(call: Callable[_Arguments, _Result], checked: bool = True) -> Callable[_Arguments, _Result]:
    """Decorates a public call: BadOption, with a correction, for an argument that it does not have; and, if
    ``checked``, for an argument of a class that its annotation does not name (``_classes_of``)."""
    title = call.__qualname__.partition(".__")[0]

    @wraps(call)
    def answered(*args: _Arguments.args, **kwargs: _Arguments.kwargs) -> _Result:
        for place, name, classes in _classes_of(call) if checked else ():
            given = args[place] if place < len(args) else kwargs.get(name, _ABSENT)
            if given is not _ABSENT and not _is_one(given, classes):
                right = " or ".join(_IN_WORDS.get(each, f"kinetile's {each.__name__}") for each in classes)
                raise BadOption(f"{title}: {name} is {shown(given)}; expected {right}")
        try:
            return call(*args, **kwargs)
        except TypeError:
            wrong = _wrong_argument(call, args, kwargs)
            if not wrong:
                raise
        raise BadOption(f"{title} {wrong}")

    return answered


def constructed(kind: type[_Class]) -> type[_Class]:
    """Decorates a public class of values: its constructor is ``answering``; later users check the values."""
    name = "__new__" if issubclass(kind, tuple) else "__init__"
    setattr(kind, name, answering(getattr(kind, name), checked=False))
    return kind


_ABSENT = object()
_IN_WORDS: Mapping[Any, str] = {
    **{bool: "True or False", str: "text", os.PathLike: "a path that files can have", type(None): "None"},
    **{Mapping: "a mapping", Iterable: "a list", Callable: "a function"},
}
_READ_APART = {"Any", "object", "int", "float", "complex", "ndarray"}


@cache
def _classes_of(call: Callable[..., Any]) -> list[tuple[int, str, tuple[type, ...]]]:
    """Returns place, name and classes of the arguments of a call whose annotations have only classes that
    Python can check. Numbers, and values that may be arrays, have readers of their own."""
    # a NamedTuple's __new__ cannot see the names of its annotations
    found, hints = [], {} if call.__name__ == "__new__" else get_type_hints(call)
    for place, each in enumerate(inspect.signature(call).parameters.values()):
        hint = hints.get(each.name)
        parts = get_args(hint) if get_origin(hint) in (Union, UnionType) else (hint,)
        kinds = (get_origin(part) or part for part in parts)
        classes = tuple(Iterable if kind is Sequence else kind for kind in kinds)  # a set is accepted
        if all(isinstance(kind, type) and kind.__name__ not in _READ_APART for kind in classes):
            by_place = each.kind <= each.POSITIONAL_OR_KEYWORD
            found.append((place if by_place else sys.maxsize, each.name, classes))
    return found


def _is_one(given: Any, classes: tuple[type, ...]) -> bool:
    """Returns True if a value is of one of these classes. NumPy's truth values are bools; text, or a single
    number of NumPy, is not a list, and a class is not a function."""
    if os.PathLike in classes and isinstance(given, str | os.PathLike):
        with suppress(UnicodeEncodeError):
            return b"\0" not in os.fsencode(given)
        return False
    if isinstance(given, str | type):
        return any(each in classes for each in (str, type) if isinstance(given, each))
    if getattr(given, "ndim", 1) == 0:
        return bool in classes and getattr(getattr(given, "dtype", None), "kind", "") == "b"
    return isinstance(given, classes)


def _within(call: Callable[..., Any], odd: str) -> str:
    """Returns the place of an argument that belongs to a value that a call takes: to its settings, say."""
    own, word = inspect.signature(call).parameters, _WORDS.get(_fold(odd), ("", "", ""))[1]
    meant = set() if nearest(odd, own) else {odd} if "scene" in own else {odd, word}
    for _, name, classes in _classes_of(call):
        for each in filter(is_dataclass, classes):
            for its in meant & inspect.signature(each).parameters.keys():
                return f"it within {name}: {name}={each.__name__}({its}=...)"
    return ""


def _wrong_argument(call: Callable[..., Any], args: Sequence[Any], kwargs: Mapping[str, Any]) -> str:
    """Returns the first argument that a call does not have, with a correction, or missing ones; or ""."""
    parameters = inspect.signature(call).parameters
    known = [each for each in parameters if each not in ("self", "_cls")]
    takes_all = any(each.kind is each.VAR_KEYWORD for each in parameters.values())
    for odd in kwargs:
        if odd not in known and not takes_all:
            wanted = key_of(odd, known, call=call)
            if "options" in known and ";" not in wanted:
                wanted += f"; an option of a phase is in options={{{odd!r}: ...}}"
            return f"has no argument {odd!r}; expected {wanted}"
    by_place = [each for each in parameters.values() if each.kind <= each.POSITIONAL_OR_KEYWORD]
    if len(args) <= len(by_place):
        needed = [each.name for each in by_place[len(args) :] if each.default is each.empty]
        lacks = [each for each in needed if each not in kwargs]
        return f"needs {' and '.join(lacks)}; expected ({', '.join(known)})" if lacks else ""
    found, count = printable(repr(args[len(by_place)]), 60), len(by_place) - len(parameters) + len(known)
    takes = f"takes {count or 'no'} argument{'' if count == 1 else 's'} by position; found {found} as well"
    if len(by_place) < len(parameters):
        return f"{takes}, expected {[*parameters][len(by_place)]}={found}"
    return f"{takes}: {_WORDS['dt'][2]}" if call.__name__.startswith("step") else takes


def _as_raised(
    kind: type[KinetileError], args: tuple[Any, ...], attributes: Mapping[str, Any]
) -> KinetileError:
    """Returns an error from its parts, without its constructor, which has already made the message."""
    error = kind.__new__(kind, *args)
    super(KinetileError, error).__init__(*args)
    vars(error).update(attributes)
    return error


def _fold(name: str) -> str:
    return name.casefold().replace("_", "-")
