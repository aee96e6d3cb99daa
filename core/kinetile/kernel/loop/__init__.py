"""The main loop: ``loop`` itself, its queue (``calendar``), the contacts of a body (``predictions``), and the
events (``events``, ``responses``, ``commands``). This module has the loop's reasons to return."""

NO_REASON = -1
TIME_REACHED, CONTACTS_REACHED, BUDGET_SPENT, LOG_FULL, NO_ROOM, FAULT = range(6)

COMMAND_DUE = 6
"""An insertion or removal needs another layout of the tables or of the structure."""

BLOCKED = 7
"""An inserted body has no room; the clock's ``fault`` has its number (a) and the obstacle (b)."""

CROWDED = 8
"""The table of pairs that are passing through each other is full."""

FASTER = 9
"""A response has made a body faster than its reach allows."""

WATCHED = 10
"""Before or after a watched contact."""
