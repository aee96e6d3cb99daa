"""Mutation: a phase with one thing changed at a time, to see what its author's tests and the kit do not see.

A check that is never seen to fail is worth little. Here the phase's own source is changed in one place, as
one easily errs, and judged; a change that nothing notices is either none (it is *equivalent*), or a mere
cost, or a fault that would go unseen.

* ``sources`` finds the modules of a phase, ``reached`` what of them is its own doing;
* ``operators`` are the changes, exact spans of the source; ``mutants`` numbers them;
* ``writing`` writes one down as a package of another name; ``judging`` does so in a child and runs checks;
* ``overlay`` runs the author's own tests on one, where it is installed;
* ``campaign`` hands mutants out, in three rounds; ``record`` keeps what came of them, ``report`` counts.
"""

from __future__ import annotations

from kinetile_conformance.mutation.campaign import Round, campaign, rounds_of
from kinetile_conformance.mutation.mutants import Equivalent, Mutant, equivalents_of, mutants_of, sample
from kinetile_conformance.mutation.overlay import passes, try_tests
from kinetile_conformance.mutation.record import Record, Stage, head_of
from kinetile_conformance.mutation.report import Finding, Findings
from kinetile_conformance.mutation.sources import PhaseSource, source_of

__all__ = [
    "Equivalent",
    "Finding",
    "Findings",
    "Mutant",
    "PhaseSource",
    "Record",
    "Round",
    "Stage",
    "campaign",
    "equivalents_of",
    "head_of",
    "mutants_of",
    "passes",
    "rounds_of",
    "sample",
    "source_of",
    "try_tests",
]
