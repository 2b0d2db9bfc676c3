"""The coordinator's queryable: what may be asked, as the parameters of a selector.

Replies, one sample each, on the same key: to none and ``version=N`` a `JointMapMessage`, to
``since=N`` one for every version after N in their order (the first K with ``limit=K``), to
``robot=ID`` and ``component=ID/K`` a complete `MapMessage` (of the robot's last run, or of that
with ``boot=BOOT``), to ``of=maps`` those of all runs, to ``of=alignments`` an `AlignmentMessage` of
each pair of runs, with ``since=N`` only what is not in version N; to ``runs=all`` a `RunsMessage`,
to ``orders=all`` an `OrdersMessage`, to ``of=status`` a `JointStatusMessage`. Agents answer the
last two as well, to ``of=status`` by a `StatusMessage`.
"""

import re
from typing import Literal, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

from mapweave_protocol.errors import MessageError
from mapweave_protocol.wire.model import ComponentName, Count, Id

_NUMBER = re.compile(r"[0-9]{1,15}")
_COUNTED = {"version", "since", "limit"}
_EXPECTED = (
    "version=N, since=N, since=N;limit=K, robot=ID, robot=ID;boot=BOOT, component=ID/K, of=maps,"
    " of=alignments, since=N;of=maps, since=N;of=alignments, of=status, runs=all, orders=all"
)
_BESIDE = {"limit": "since", "boot": "robot"}  # what refines another question


class JointQuery(BaseModel):
    """A question to the coordinator: one of these, or none for the latest joint map.

    Attributes
    ----------
    version
        The joint map of this number.
    since
        All joint maps of a higher number.
    limit
        No more of them than so many, those that come first.
    robot
        The last map of this robot, gone or not.
    boot
        Of which run of it.
    of
        All of these instead of joint maps.
    component
        The map of the run that this component is, or was, of.
    runs
        Which runs there are, of all robots.
    orders
        All orders of operators.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)

    version: Count | None = Field(default=None)
    since: Count | None = Field(default=None)
    limit: int | None = Field(default=None, ge=1, le=2**53)
    robot: Id | None = Field(default=None)
    boot: Id | None = Field(default=None)
    of: Literal["maps", "alignments", "status"] | None = Field(default=None)
    component: ComponentName | None = Field(default=None)
    runs: Literal["all"] | None = Field(default=None)
    orders: Literal["all"] | None = Field(default=None)

    @model_validator(mode="after")
    def _check(self) -> Self:
        given = self._given().keys()
        if len(given - _BESIDE.keys()) > 1 and given != {"since", "of"}:
            raise ValueError("expected one question")
        if "since" in given and self.of == "status":
            raise ValueError("since, expected beside maps or alignments only")
        for name, other in _BESIDE.items():
            if name in given and other not in given:
                raise ValueError(f"{name}, expected beside {other} only")
        return self

    @property
    def parameters(self) -> str:
        """The part of the selector after the question mark."""
        return ";".join(f"{name}={value}" for name, value in self._given().items())

    @classmethod
    def parse(cls, parameters: str) -> Self:
        """Return the query that `parameters` says.

        Raises
        ------
        MessageError
            If it is none.
        """
        pairs = [part.partition("=") for part in parameters.split(";") if part]
        values: dict[str, int | str] = {
            name: int(value) if name in _COUNTED and _NUMBER.fullmatch(value) else value
            for name, _, value in pairs
        }
        try:
            return cls.model_validate(values)
        except ValueError as error:
            expected = f"expected one of {_EXPECTED}, or nothing"
            raise MessageError("query", f"{parameters[:80]!r}: {expected}") from error

    def _given(self) -> dict[str, int | str]:
        return self.model_dump(exclude_none=True)
