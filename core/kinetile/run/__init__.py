"""Runs: phases composed into one loop, the engine around it, and ``Simulation``, the public class."""
