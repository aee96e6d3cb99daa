"""Versions that a result depends on: kinetile, Python, NumPy, and the compiler Numba."""

__version__ = "0.1.0"


def versions() -> dict[str, str]:
    """Returns the versions of kinetile, Python, NumPy and Numba."""
    import platform  # these two take longer to import than the rest of `import kinetile`
    from importlib.metadata import PackageNotFoundError, version

    found = {"python": platform.python_version()}
    for name in ("kinetile", "numpy", "numba"):
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "not installed"
    return found
