"""What does the tasks: processes of this machine, any executor of ``concurrent.futures``, a Dask cluster.

* ``engine``: what all have in common, and an executor that was brought;
* ``local``: processes of this machine; ``worker``: what happens in them;
* ``cluster``: Dask;
* ``driving``: tasks are handed out and rows taken in.
"""
