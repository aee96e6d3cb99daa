"""Choices of phases as text: a name, perhaps with options (``sap-1d:axis=y``), and lists of choices."""

from collections.abc import Callable, Iterable, Mapping
from typing import Any

from kinetile.errors import BadOption

_WORDS = {"true": True, "false": False, "none": None}


def read_value(text: str) -> Any:
    """Returns the value of a text: a whole number, a number, true, false, none, a TOML array, or itself."""
    for reading in (int, float):
        try:
            return reading(text)
        except ValueError:
            pass
    if text.lower() in _WORDS:
        return _WORDS[text.lower()]
    if text[:1] in ("[", '"', "'"):
        import tomllib

        try:
            return tomllib.loads(f"value = {text}")["value"]
        except (ValueError, RecursionError):  # Python's own: whole numbers too long, lists too deep
            return text
    return text


def read_option(text: str) -> Any:
    """Returns the value of a phase's option, by ``read_value``; but ``none``, a frequent choice, is that
    word, and ``None`` is Python's None, as ``write_phase`` writes it."""
    return text if text == "none" else read_value(text)


def read_assignments(
    texts: Iterable[str], where: str, read: Callable[[str], Any] = read_value
) -> dict[str, Any]:
    """Returns ``key=value`` texts as a dictionary, dashes in keys as underscores; BadOption for others."""
    found: dict[str, Any] = {}
    for text in texts:
        key, equals, value = text.partition("=")
        key = key.strip().replace("-", "_")
        if not equals or not key:
            raise BadOption(f"{where} {text!r}: expected key=value, such as seed=7")
        if key in found:
            raise BadOption(f"{where} {text!r}: {key} is given twice")
        found[key] = read(value.strip())
    return found


def read_phase(text: str, what: str = "phase") -> tuple[str, dict[str, Any]]:
    """Returns name and options of a phase, ``sap-1d`` or ``sap-1d:axis=y,other=2``, ``what`` in messages."""
    name, _, options = text.strip().partition(":")
    if not name or "=" in name:
        raise BadOption(
            f"{text!r} names no {what}; expected a name, and options behind a colon: NAME:key=value"
        )
    return name, read_assignments(filter(None, options.split(",")), f"{what} {name!r}: option", read_option)


def write_phase(name: str, options: Mapping[str, Any]) -> str:
    """Returns the text of a phase that ``read_phase`` reads."""
    return f"{name}:{','.join(f'{key}={value}' for key, value in options.items())}" if options else name


def called(name: str, options: Mapping[str, Any]) -> str:
    """Returns a name with its options or parameters behind it, for people: ``sap-1d (axis=y)``."""
    return f"{name} ({', '.join(f'{key}={value}' for key, value in options.items())})" if options else name


def read_phases(text: str) -> list[str]:
    """Returns the phases of a list with commas; ``key=value`` after one with options is a further option."""
    phases: list[str] = []
    for piece in filter(None, (piece.strip() for piece in text.split(","))):
        if not phases or "=" not in piece or ":" in piece.partition("=")[0]:
            phases.append(piece)
        elif ":" in phases[-1]:
            phases[-1] += f",{piece}"
        else:
            raise BadOption(f"{piece!r} is an option: expected a colon before it, {phases[-1]}:{piece}")
    return phases
