"""The study file: what may stand in it, and the tasks that it comes to."""

from __future__ import annotations

from kinetile_bench.study.file.reading import Plan, read_plan, read_plan_file
from kinetile_bench.study.file.tasks import Task, tasks_of

__all__ = ["Plan", "Task", "read_plan", "read_plan_file", "tasks_of"]
