"""How a phase is judged: scenes are drawn and shown to checks, what fails is made smaller, and a report says
what came of it.

``doors`` is the function that programs call; ``court`` judges check by check; ``drawing`` and ``reduction``
have the scenes, ``limits`` the time, ``verdicts`` whom a failure speaks against, ``report`` what is said, and
``telling`` what is told beside it.
"""

from __future__ import annotations

__all__: list[str] = []
