"""``kinetile``, and ``python -m kinetile`` where that command is not on the path: the command line.

The modules of the command line are imported inside ``main``: that takes most of a second, and Ctrl-C may come
in it as well.
"""

from __future__ import annotations

import signal
import sys
from contextlib import suppress


def main() -> None:
    """Runs the command line."""
    try:
        from kinetile.cli import main as command

        command()
    except KeyboardInterrupt:
        with suppress(OSError, AttributeError):  # stderr may be closed or missing
            sys.stderr.write("kinetile: interrupted\n")
        raise SystemExit(128 + signal.SIGINT) from None


if __name__ == "__main__":
    main()
