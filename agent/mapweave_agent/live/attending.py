"""A thread that attends to everything but mapping."""

import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager


@contextmanager
def attending(attend: Callable[[], None]) -> Iterator[Callable[[], bool]]:
    """Call `attend` again and again in a thread of its own; give a block what tells it failed."""
    over = threading.Event()

    def attend_all() -> None:
        while not over.is_set():
            attend()

    with ThreadPoolExecutor(1, thread_name_prefix="attending") as thread:
        attended = thread.submit(attend_all)
        try:
            yield attended.done
        finally:
            over.set()
        attended.result()
