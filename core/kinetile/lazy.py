"""Names that a package imports at their first use, so that importing the package is cheap."""

from __future__ import annotations

import ast
import sys
from collections.abc import Callable
from importlib import import_module
from linecache import getlines
from typing import Any


def lazy_names(package: str) -> tuple[list[str], Callable[[str], Any]]:
    """Returns the names that a module imports under ``if TYPE_CHECKING``, and its ``__getattr__``, which
    imports them: what type checkers read is the only table. Any other name is an AttributeError."""
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
