"""The main loop: ``loop`` itself, its queue (``calendar``), what a body awaits (``predictions``), and what
happens at an event (``events``, ``responses``, ``commands``). Here are the reasons for which it returns."""

NO_REASON = -1
TIME_REACHED, CONTACTS_REACHED, BUDGET_SPENT, LOG_FULL, NO_ROOM, FAULT = range(6)

COMMAND_DUE = 6
"""A body is inserted or removed for which the tables, or the structure, must be laid out again."""

BLOCKED = 7
"""There is no room for an inserted body; the clock's ``fault`` has its number (a) and what blocks it (b)."""

CROWDED = 8
"""The table of pairs that are passing through each other is full."""

FASTER = 9
"""A response has made a body faster than its reach allows for."""

WATCHED = 10
"""At a watched contact, before it or after."""
