"""Imports at the first use: the names of a package, so that importing it is cheap, and optional packages."""

import ast
import sys
from collections.abc import Callable
from importlib import import_module
from linecache import getlines
from typing import Any


def lazy_names(package: str) -> tuple[list[str], Callable[[str], Any]]:
    """Returns the names that a module imports under ``if TYPE_CHECKING``, and its ``__getattr__``, which
    imports them: the imports for type checkers are the only table. Any other name is an AttributeError."""
    module: Any = sys.modules[package]
    source = ast.parse("".join(getlines(module.__file__, vars(module))))
    blocks = [each for each in source.body if isinstance(each, ast.If)]
    imports = [each for block in blocks if isinstance(block.test, ast.Name) for each in block.body]
    homes = {
        name.name: each.module for each in imports if isinstance(each, ast.ImportFrom) for name in each.names
    }

    def attribute(name: str) -> Any:
        if name in homes:
            return getattr(import_module(homes[name] or ""), name)
        from kinetile.errors import no_attribute

        raise no_attribute(module, name)

    return sorted(homes), attribute


def needed(purpose: str, package: str, extra: str, module: str = "") -> Any:
    """Returns the module of an optional package; MissingExtra if it is not installed."""
    try:
        return import_module(module or package)
    except ImportError as error:
        from kinetile.errors import MissingExtra

        raise MissingExtra(purpose, package, extra) from error
