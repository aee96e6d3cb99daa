"""Questions about the present moment: which bodies are where, and which of them will meet.

Every answer is a function of the flight plans and of the present tick alone: no question reads
the structure of a broad phase or the results in the queue. So answers are the same under every phase,
and a question changes nothing.

*When* two bodies meet is computed by the narrow phase, as in the loop: the answer is the tick that the
contact will have in the log (``meetings``). *Where* bodies are now is known in doubles, those of
``Simulation.positions``, and so are the answers about places (``places``).

All functions take a ``Query``, which names the slots of the bodies in question: all present ones, or those
that are known to be enough. They return slots; ``Simulation`` turns these into the numbers of bodies.
"""
