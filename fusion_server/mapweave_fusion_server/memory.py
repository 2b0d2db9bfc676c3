"""Memory that is free goes back to the system.

Rasters come and go between what stays, a version of the joint map after the other. The C library
keeps the holes for itself: with twenty robots it holds a fifth more than is used after ten minutes.
"""

import ctypes
import sys

GIVEN_BACK = 30.0  # [s] from one time to the next: it takes some milliseconds


def give_back() -> bool:
    """Give back what is free; return whether the C library can do that: glibc."""
    if not sys.platform.startswith("linux"):
        return False
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if trim is None:
        return False
    trim(0)
    return True
