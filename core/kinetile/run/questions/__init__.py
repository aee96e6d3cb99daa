"""Questions about the present moment: which bodies are where, and which of them will meet.

Every answer is a function of the flight plans and of the present tick alone, so it is the same under every
phase, and a question changes nothing. *When* two bodies meet is computed by the narrow phase, as in the loop,
to the tick (``meetings``). *Where* bodies are now is known in doubles, those of ``Simulation.positions``
(``places``). All functions take a ``Query``, which names the slots of the bodies in question, and return
slots.
"""
