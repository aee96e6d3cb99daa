"""How Sphinx makes a site of these pages.

The command: ``sphinx-build -W --keep-going -n -b html -d build/doctrees docs build/site``.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

HERE = Path(__file__).parent

# Nothing that is drawn for these pages runs long: interpreted, it is there before a loop would be compiled.
# The processes of notebooks, which show speeds, compile.
os.environ["NUMBA_DISABLE_JIT"] = "1"
import kinetile.kernel.compiled  # noqa: E402, F401  (it reads the variable now)

del os.environ["NUMBA_DISABLE_JIT"]

sys.path.insert(0, str(HERE / "_ext"))

project = "kinetile"
author = "The kinetile authors"
copyright = "2026, The kinetile authors"

extensions = ["myst_nb", *sorted(path.stem for path in (HERE / "_ext").glob("*.py"))]
exclude_patterns = ["_ext", "examples", "figures"]

html_theme = "furo"
html_title = "kinetile"
html_static_path = ["_static"]
html_copy_source = False
html_favicon = "_static/favicon.svg"
html_css_files = ["site.css"]

myst_enable_extensions = ["html_image"]
myst_heading_anchors = 4
# Links to files that are no documents: see _ext/outside.py. The others are what they would be without this.
myst_url_schemes = {
    **dict.fromkeys(("http", "https", "mailto")),
    "source": {"url": "source/{{path}}.html", "title": "{{path}}"},
}

# The interface: names as they are imported, types as they are written.
autodoc_member_order = "bysource"
autodoc_typehints_format = "short"
autodoc_preserve_defaults = True
autodoc_type_aliases = {
    "npt.ArrayLike": "ArrayLike",
    "Radii": "ArrayLike | None",
    "Accelerations": "ArrayLike | None",
    "ShapeOfEach": "ArrayLike | Shape | None",
}
python_use_unqualified_type_names = True
maximum_signature_line_length = 88

# Every other reference must lead somewhere. These are of other packages, whose sites are not asked for where
# their names are, for the site is built without a network; and of what is no interface.
nitpick_ignore_regex = [
    ("py:.*", r"(PIL|collections|concurrent|numpy|pathlib|os|pluggy|hypothesis|np|npt|typing)\..*"),
    ("py:.*", r"ArrayLike.*|NDArray|Floats|Integers|Flags|Rows|Image|Path|PluginManager.*"),
    ("py:.*", r"float64|int64|int32|void|Hook|Kind|EventKind|Source|Spec|StudyStopped"),
    ("py:.*", r"kinetile\.(run|kernel)\..*\.(AcceleratedPlan|Command|Composition|Engine|Entries|F|Held)"),
    ("py:.*", r"kinetile\.(run|kernel)\..*\.(History|Kept|RunState|SavedPhases)"),
    ("py:.*", r"kinetile\.(errors\._\w+|show\.picture\.Look)"),
    ("py:.*", r"kinetile[\w.]*\.(Disagreement|Enclosure|FirstDifference|Observation|Spec|Strategy)"),
    ("py:.*", r"kinetile[\w.]*\.(Oracle|Page|Reference|RunOutcome|Section|StudyScene|Subject)"),
]

# Notebooks are kept without what they print: they are run here, and what they raise is an error.
nb_execution_mode = "force"
nb_execution_raise_on_error = True
nb_execution_timeout = 600

live_cache = "../build/live"
live_plugins = {"kinetile_thesis": "examples/kinetile-thesis"}
