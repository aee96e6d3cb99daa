"""The kernel: tables, clock, queue, certificates and the compiled loop.

It uses neither scenes nor plugins.
"""
