"""Docstrings of the code as they are meant: sections ``Args:``, ``Raises:``, ``Attributes:``, and prose.

Some things differ from Sphinx's own reading of them (``sphinx.ext.napoleon``). The first line of a property
is prose, where that takes what stands before a colon for a type. A constant that a package hands on, such as
``kinetile.CONTACT``, has the docstring of the module in which it stands, and not that of its class. Fields of
named tuples without a description are left out: the signature has them. Arrays are called by the short
name under which the code has them. And a name in a docstring is that of the module in which it stands, also
where another module has one like it.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from typing import Any

from docutils import nodes
from sphinx.addnodes import desc_signature, pending_xref
from sphinx.application import Sphinx
from sphinx.domains.python import PyObject
from sphinx.errors import PycodeError
from sphinx.ext.napoleon import Config, GoogleDocstring
from sphinx.pycode import ModuleAnalyzer

READ = Config(napoleon_use_ivar=True, napoleon_use_rtype=False)

ARRAY = re.compile(
    r"(~?numpy\.)?ndarray\[tuple\[(~?typing\.)?Any, \.\.\.\], (~?numpy\.)?dtype\[(~?numpy\.)?(\w+)\]\]"
)
"""What ``NDArray[...]`` comes to."""

SEVERAL = re.compile(r"^:ivar \w+(, \w+)+:")
"""Attributes that are described together: without spaces, or all but the last would be a type."""


def read(app: Sphinx, what: str, name: str, obj: object, options: Any, lines: list[str]) -> None:
    """Make of a docstring what Sphinx understands."""
    if what == "data":
        found = next(homes(name.rpartition(".")[2], obj), None)
        lines[:] = found if found is not None else lines
    kind = "" if what in ("attribute", "data", "property") else what
    read_lines = GoogleDocstring(lines, READ, app, kind, name, obj, options).lines()
    lines[:] = [SEVERAL.sub(lambda found: found[0].replace(", ", ","), line) for line in read_lines]


def homes(name: str, value: object) -> Iterator[list[str]]:
    """Yield the docstrings of a constant of this name and value in modules of kinetile."""
    for module in sorted(each for each in sys.modules if each.startswith("kinetile.")):
        if getattr(sys.modules[module], "__dict__", {}).get(name) is value:
            try:
                documented = ModuleAnalyzer.for_module(module).find_attr_docs()
            except PycodeError:
                continue
            if ("", name) in documented:
                yield list(documented["", name])


def shorten(
    app: Sphinx, what: str, name: str, obj: object, options: Any, arguments: str | None, result: str | None
) -> tuple[str | None, str | None]:
    """Write arrays in a signature as the code does; a default that is made for each has no name."""
    arguments = (
        None if arguments is None else ARRAY.sub(r"NDArray[\5]", arguments.replace("<factory>", "..."))
    )
    return arguments, None if result is None else ARRAY.sub(r"NDArray[\5]", result)


def leave_out(app: Sphinx, what: str, name: str, obj: object, skip: bool, options: Any) -> bool | None:
    """Whether to leave a member out: True, or None where that is for others to say."""
    said = getattr(obj, "__doc__", None) or ""
    return True if said.startswith("Alias for field number ") else None


def qualify(app: Sphinx, page: nodes.document) -> None:
    """Write names in full, as they are in the module of the class in which they are mentioned."""
    for link in page.findall(pending_xref):
        name, module, within = link.get("reftarget", ""), link.get("py:module"), link.get("py:class")
        if link.get("refdomain") != "py" or not name.isidentifier():
            continue
        above = link.parent
        while above is not None and not within:
            if isinstance(above, desc_signature):
                module, within = above["module"], above["fullname"].partition(".")[0]
            above = above.parent
        owner = getattr(sys.modules.get(module or ""), within or "", None)
        meant = getattr(sys.modules.get(getattr(owner, "__module__", "")), name, None)
        if isinstance(meant, type):
            link["reftarget"] = f"{meant.__module__}.{meant.__qualname__}"


def setup(app: Sphinx) -> dict[str, Any]:
    """Make this known to Sphinx."""
    app.setup_extension("sphinx.ext.autodoc")
    for field in PyObject.doc_field_types:
        if field.name == "variable":
            field.label = "Attributes"
    app.connect("autodoc-process-docstring", read)
    app.connect("autodoc-process-signature", shorten)
    app.connect("doctree-read", qualify)
    app.connect("autodoc-skip-member", leave_out)
    return {"version": "1", "parallel_read_safe": True}
