"""What `mutations.toml` holds: single lines of the code made wrong, and the tests that notice."""

import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

from pydantic import BaseModel, ConfigDict, Field

from mapweave.errors import FileError

ENTRIES = Path(__file__).with_name("mutations.toml")
Room = Literal[
    "merging",
    "similarity",
    "hypotheses",
    "verification",
    "tracking",
    "protocol",
    "agent",
    "coordinator",
]


class Mutation(BaseModel):
    """One place in the code, made wrong.

    Attributes
    ----------
    name
        What is wrong, in words joined by hyphens.
    room
        What part of the program it is of.
    survived
        Whether it is one of those that no test noticed once; none of these may survive again.
    file
        Of the code, from the root of the tree.
    before, after
        The text as it is, found once in the file, and what replaces it.
    guards
        Files of tests, or single tests as pytest names them, from the root of the tree.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: str = Field(pattern=r"^[a-z0-9]+(-[a-z0-9]+)*$")
    room: Room
    survived: bool = False
    file: str
    before: str = Field(min_length=1)
    after: str
    guards: tuple[str, ...] = Field(min_length=1)

    def apply(self, tree: Path) -> str:
        """Make the code in `tree` wrong; return the text of the file as it was.

        Raises
        ------
        FileError
            If the text is not there, or more than once.
        """
        path = tree / self.file
        text = path.read_text()
        found = text.count(self.before)
        if found != 1:
            place = f"mutation {self.name}: expected {self.before!r} once"
            raise FileError(path, f"{place}, found it {found} times")
        path.write_text(text.replace(self.before, self.after))
        return text


def read_entries(path: Path = ENTRIES) -> tuple[Mutation, ...]:
    """Return the mutations that the file at `path` lists."""
    listed = tomllib.loads(path.read_text())["mutation"]
    return tuple(Mutation.model_validate(entry) for entry in listed)


def chosen(entries: Sequence[Mutation], only: Sequence[str]) -> list[Mutation]:
    """Return those of the names or rooms in `only`; all where it is empty.

    Raises
    ------
    ValueError
        If there is none of a name or room.
    """
    known = {name for entry in entries for name in (entry.name, entry.room)}
    for name in only:
        if name not in known:
            raise ValueError(f"no mutation and no room {name!r}; {ENTRIES.name} lists them")
    return [m for m in entries if not only or m.name in only or m.room in only]
