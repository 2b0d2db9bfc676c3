"""Which kernels are used: the compiled ones, where they were built, or their NumPy twins.

Kernels that were compiled from other sources than those beside this module, as after an update of a
checkout, would compute what the code no longer means: they are left out, and that is said.
"""

import hashlib
import importlib
import os
from pathlib import Path
from types import ModuleType

PURE = "MAPWEAVE_PURE"  # set to 1, this variable selects the twins
SLOWER = "the same maps, some ten times slower"
COMPILE = "pip install --no-deps --editable ."

NOT_COMPILED = (
    f"kernels were not compiled at installation (no C++ compiler, or no Python headers?): {SLOWER}"
)
OTHER_SOURCES = (
    "kernels were compiled from other sources than these, and are not used:"
    f" {SLOWER}, until they are compiled again: {COMPILE}"
)


def load_compiled(folder: Path) -> tuple[ModuleType | None, str | None]:
    """Return the compiled kernels; None where they were not built, do not fit, or are not wanted.

    Parameters
    ----------
    folder
        Where their sources are, in a checkout; an installed package has none.

    Returns
    -------
    kernels, problem
        The second a line for a person where kernels are wanted and there are none, else None.
    """
    if os.environ.get(PURE, "0") not in ("", "0"):
        return None, None
    try:
        compiled = importlib.import_module("mapweave.kernels._compiled")
    except ModuleNotFoundError:
        return None, NOT_COMPILED
    except ImportError as error:  # of another machine, or cut off
        return None, f"kernels cannot be loaded ({error}): {SLOWER}; install mapweave again"
    here = digest_of_sources(folder)
    of = compiled.sources() if hasattr(compiled, "sources") else None
    return (None, OTHER_SOURCES) if here not in (None, of) else (compiled, None)


def digest_of_sources(folder: Path) -> str | None:
    """Return what CMakeLists.txt makes of the sources in `folder`; None where there are none."""
    sources = sorted([*folder.glob("*.cpp"), *folder.glob("*.hpp")])
    digests = (f"{s.name} {hashlib.sha256(s.read_bytes()).hexdigest()}\n" for s in sources)
    return hashlib.sha256("".join(digests).encode()).hexdigest() if sources else None


COMPILED, _PROBLEM = load_compiled(Path(__file__).parent)


def missing() -> str | None:
    """Return a line for a person where kernels are wanted and there are none, else None."""
    return _PROBLEM
