"""What happened before one began to listen comes all at once: it is told as what was."""

from collections.abc import Iterable, Iterator

WITHIN = 3.0  # [s] it has come, also in a team that is never quiet


class Past:
    """Marks the lines that tell what was before, until it is quiet for the first time."""

    def __init__(self) -> None:
        self._began: float | None = None
        self._is_over = False

    def marked(self, lines: Iterable[str]) -> Iterator[str]:
        """Yield `lines`; those that tell what was before say so."""
        for line in lines:
            yield line if self._is_over else f"before: {line}"

    def heard(self, now: float, *, something: bool) -> None:
        """Note that something came by `now` [s], or that it is quiet."""
        self._began = now if self._began is None else self._began
        self._is_over |= not something or now - self._began >= WITHIN
