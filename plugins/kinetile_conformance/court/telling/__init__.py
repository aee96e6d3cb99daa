"""What is told of a result beside the report: a picture, JUnit XML, what authors usually did wrong."""

from __future__ import annotations

__all__: list[str] = []
