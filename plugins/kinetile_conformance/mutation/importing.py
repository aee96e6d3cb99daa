"""The import of a package with one module changed, perhaps under another name.

No file is written: the changed text is compiled in place of the file's, under the file's name. This file uses
the standard library alone, because it is also the ``sitecustomize`` of an author's own tests.
"""

from __future__ import annotations

import importlib.util
import re
import sys
from importlib.machinery import ModuleSpec, SourceFileLoader
from types import CodeType


class ChangedLoader(SourceFileLoader):
    """Loads a text in place of a file's."""

    text = ""

    def get_code(self, fullname: str) -> CodeType:
        """Returns the text, compiled."""
        code: CodeType = compile(self.text, self.path, "exec", dont_inherit=True)
        return code


class ChangedFinder:
    """Finds the modules of the package ``root`` as those of ``alias``, and in place of the text of ``module``
    another. Under an alias the original stays as it is, for the same process."""

    def __init__(self, root: str, alias: str, module: str, text: str) -> None:
        self._root, self._alias, self._module, self._text = root, alias, module, text
        sys.meta_path.insert(0, self)

    def find_spec(self, name: str, path: object = None, target: object = None) -> ModuleSpec | None:
        """Returns the spec of a module; None where it is found as always."""
        original = self._root + name.removeprefix(self._alias)
        if name.partition(".")[0] != self._alias or name == original != self._module:
            return None
        sys.meta_path.remove(self)
        try:
            found = importlib.util.find_spec(original)
        finally:
            sys.meta_path.insert(0, self)
        if found is None or found.origin is None or not found.origin.endswith(".py"):
            return found
        loader = ChangedLoader(name, found.origin)
        text = self._text if original == self._module else loader.get_data(found.origin).decode()
        own = rf"^(\s*from ){re.escape(self._root)}(?=[.\s])"  # it imports from itself, by its full name
        loader.text = re.sub(own, rf"\g<1>{self._alias}", text, flags=re.MULTILINE)
        inner = found.submodule_search_locations
        spec = importlib.util.spec_from_file_location
        return spec(name, found.origin, loader=loader, submodule_search_locations=inner)
