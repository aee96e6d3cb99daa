"""``python -m kinetile``: the command line, where the command ``kinetile`` is not on the path."""

from __future__ import annotations

from kinetile.cli import main

__all__: list[str] = []

if __name__ == "__main__":
    main()
