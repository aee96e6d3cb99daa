"""The phases as kinetic data structures: the counts of docs/which-broad-phase.md.

``python docs/figures/criteria.py``: for each phase and number of discs, of the recipe ``grid`` at density .5,
what 20,000 contacts need: failed certificates and scheduled ones a contact, and pairs kept a body.
"""

import kinetile as kt

PHASES = ("cells", "sap-1d", "sap-2d", "sweep-tiling", "power")
CONTACTS = 20_000

for phase in PHASES:
    for bodies in (100, 400, 1600):
        sim = kt.Simulation(kt.make_scene("grid", bodies=bodies, density=0.5, seed=1), phase)
        sim.run(max_contacts=CONTACTS)
        found = sim.readings
        failed, scheduled = found.structural_events / CONTACTS, found.certificates_updated / CONTACTS
        pairs = found.pairs_max / bodies
        print(f"{phase:13}{bodies:6}{failed:9.2f} failed{scheduled:9.1f} scheduled{pairs:7.2f} pairs")
