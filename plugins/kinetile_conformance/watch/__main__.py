"""Run ``python -m kinetile_conformance.watch``: a child that watches interpreted hooks."""

from __future__ import annotations

from kinetile_conformance.watch.child import main

main()
