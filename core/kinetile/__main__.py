"""``kinetile``, and ``python -m kinetile`` where that command is not on the path: the command line.

What the command line is made of is imported here and not above, for that takes most of a second, in which
Ctrl-C may come as well.
"""

from __future__ import annotations

import signal
import sys
from contextlib import suppress

__all__ = ["main"]


def main() -> None:
    """Run the command line."""
    try:
        from kinetile.cli import main as command

        command()
    except KeyboardInterrupt:
        with suppress(OSError, AttributeError):  # stderr may be closed, or not be there at all
            sys.stderr.write("kinetile: interrupted\n")
        raise SystemExit(128 + signal.SIGINT) from None


if __name__ == "__main__":
    main()
