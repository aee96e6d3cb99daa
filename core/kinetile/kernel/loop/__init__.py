"""The main loop: ``loop`` itself, its queue (``calendar``), what it expects of a body (``predictions``), and
what it carries out (``responses``, ``commands``). Here are the reasons for which it returns."""

from __future__ import annotations

NO_REASON = -1
TIME_REACHED, CONTACTS_REACHED, BUDGET_SPENT, LOG_FULL, NO_ROOM, FAULT = range(6)

COMMAND_DUE = 6
"""A body comes or goes for which the tables, or the structure, have to be laid out anew."""

BLOCKED = 7
"""There is no room for a body that comes; the clock's ``fault`` has its number (a), and what is in its way
(b)."""

CROWDED = 8
"""The table of pairs that are passing through each other is full."""

FASTER = 9
"""A response has made a body faster than its reach allows for."""

WATCHED = 10
"""At a contact that somebody watches, before it or after."""
