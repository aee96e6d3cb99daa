"""The command line: ``kinetile``, or ``python -m kinetile`` if that command is not on the path.

``main`` imports the modules of the command line: that takes most of a second, and a user may press Ctrl-C
then. Ctrl-C waits while modules are imported or machine code is loaded.
"""

import gc
import signal
import sys
from contextlib import suppress
from types import FrameType


def main() -> None:
    """Runs the command line."""
    # Modules and compiled code are more than a hundred thousand objects that stay. A collection of them #
    # whenever 700 have been added, and again at the end, takes a seventh of a short run.
    gc.set_threshold(200_000)
    try:
        from kinetile.run.interrupts import comes_later

        def interrupt(number: int, frame: FrameType | None) -> None:
            if not comes_later(number, frame):
                raise KeyboardInterrupt

        if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
            signal.signal(signal.SIGINT, interrupt)
        from kinetile.cli import main as command

        command()
    except KeyboardInterrupt:
        with suppress(OSError, AttributeError):  # stderr may be closed or missing
            sys.stderr.write("kinetile: interrupted\n")
        raise SystemExit(128 + signal.SIGINT) from None
    finally:
        gc.disable()


if __name__ == "__main__":
    main()
