"""The rows of a study: a Parquet dataset that whoever is killed leaves whole.

* ``columns``: what a row has;
* ``rows``: rows written one by one, gathered into parts, read;
* ``claims``: who is at which task;
* ``agreement``: the same scene under different phases must have one fingerprint.
"""
