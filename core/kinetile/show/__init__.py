"""Pictures and pages: ``picture`` draws a moment of a run, with the structure of its broad phase; ``player``
makes a page that plays a run exactly, from its flight plans; ``notebook`` shows both in Jupyter."""
