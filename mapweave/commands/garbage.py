"""What a program that maps has loaded is not looked through for garbage again and again."""

import gc
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def spared() -> Iterator[None]:
    """Spare all that is there by now, as long as the block lasts: looking at it takes 40 ms a time.

    A scan that meets such a search would wait for it. What comes into being later is collected as
    ever, and all of it once the block is over.
    """
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()
