"""Run ``python -m kinetile.conformance.watch``: a child that watches interpreted hooks."""

from __future__ import annotations

from kinetile.conformance.watch.child import main

main()
