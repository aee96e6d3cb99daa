"""Questions about the present moment: the positions of bodies, and their next contacts.

Every answer is a function of the flight plans and of the present tick alone, so it is the same under every
phase, and a question changes nothing. The narrow phase computes the tick at which two bodies meet, as in the
loop (``meetings``). Positions are doubles, the same as ``Simulation.positions`` (``places``). All functions
take a ``Query``, which names the slots of the bodies in question, and return slots.
"""
