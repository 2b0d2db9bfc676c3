"""What `mutations.toml` holds: single rules of the code made wrong, and the tests that notice."""

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


class Place(BaseModel):
    """Where code is made wrong, and how.

    Attributes
    ----------
    file
        Of the code, from the root of the tree.
    before, after
        The text as it is, found once in the file, and what replaces it.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    file: str
    before: str = Field(min_length=1)
    after: str

    def replace_in(self, text: str, name: str) -> str:
        """Return the `text` of the file made wrong, by the mutation `name`.

        Raises
        ------
        FileError
            If the place is not there, or more than once.
        """
        found = text.count(self.before)
        if found != 1:
            place = f"mutation {name}: expected {self.before!r} once"
            raise FileError(Path(self.file), f"{place}, found it {found} times")
        return text.replace(self.before, self.after)


class Mutation(Place):
    """One rule in the code, made wrong.

    Attributes
    ----------
    name
        What is wrong, in words joined by hyphens.
    room
        What part of the program it is of.
    survived
        Whether it is one of those that no test noticed once; none of these may survive again.
    file, before, after
        The place; of a rule with a kernel, in the NumPy twin.
    kernel
        The same rule in the compiled kernel, and what follows of it there, such as bounds.
    guards
        Files of tests, or single tests as pytest names them, from the root of the tree.
    """

    name: str = Field(pattern=r"^[a-z0-9]+(-[a-z0-9]+)*$")
    room: Room
    survived: bool = False
    kernel: tuple[Place, ...] = ()
    guards: tuple[str, ...] = Field(min_length=1)

    @property
    def places(self) -> tuple[Place, ...]:
        """All that is made wrong."""
        return (self, *self.kernel)

    def apply(self, tree: Path) -> dict[str, str]:
        """Make the code in `tree` wrong; return the texts of the files as they were.

        Raises
        ------
        FileError
            If a place is not there, or more than once; no file is changed then.
        """
        right = {place.file: (tree / place.file).read_text() for place in self.places}
        wrong = right.copy()
        for place in self.places:
            wrong[place.file] = place.replace_in(wrong[place.file], self.name)
        for file, text in wrong.items():
            (tree / file).write_text(text)
        return right


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
