"""Benchmarks and studies: the speed of broad phases on scenes of the thesis and of the user. A study is a
table of scenes, phases and seeds that is run task by task, and continues where it was stopped."""

from typing import TYPE_CHECKING

from kinetile.lazy import lazy_names

if TYPE_CHECKING:
    from kinetile_bench.study import Study as Study

__all__, __getattr__ = lazy_names(__name__)
