"""Which kernels are used: the compiled ones, where they were built, or their NumPy twins."""

import importlib
import os
from types import ModuleType

PURE = "MAPWEAVE_PURE"  # set to 1, this variable selects the twins


def load_compiled() -> ModuleType | None:
    """Return the compiled kernels; None where they were not built, or are not wanted."""
    if os.environ.get(PURE, "0") not in ("", "0"):
        return None
    try:
        return importlib.import_module("mapweave.kernels._compiled")
    except ModuleNotFoundError:
        return None


COMPILED = load_compiled()


def missing() -> str | None:
    """Return a line for a person where kernels are wanted and were not compiled, else None."""
    if COMPILED is not None or os.environ.get(PURE, "0") not in ("", "0"):
        return None
    return (
        "kernels were not compiled at installation (no C++ compiler, or no Python headers?):"
        " the same maps, some ten times slower"
    )
