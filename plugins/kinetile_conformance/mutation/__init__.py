"""Mutation: a phase with one thing changed at a time, to find what its author's tests and the kit miss.

A check that is never seen to fail is worth little. Here the phase's own source is changed in one place, as
one easily errs, and judged; a change that nothing notices is either none (it is *equivalent*), or a mere
cost, or a fault that would go unseen.

* ``sources`` reads the modules of a phase; ``operators`` are the changes, exact spans of the source;
* ``mutants`` numbers the changes of what the phase's class reaches;
* ``writing`` writes a mutant as a package of another name, or runs the author's own tests on it;
* ``judging`` runs checks on mutants, in a child; ``campaign`` distributes mutants to children, in three
  rounds;
* ``findings`` keeps the results in a file, and counts them.
"""
