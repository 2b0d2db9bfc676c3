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
