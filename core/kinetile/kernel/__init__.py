"""The kernel: tables, clock, queue, certificates and the compiled loop.

It knows neither scenes nor plugins.
"""
