"""The coordinator's queryable: what may be asked, as the parameters of a selector.

Replies, one sample each, on the same key: to none and ``version=N`` a `JointMapMessage`, to
``since=N`` one for every version after N in their order (the first K with ``limit=K``), to
``robot=ID`` and ``component=ID/K`` a complete `MapMessage`, to ``runs=all`` a `RunsMessage`, to
``orders=all`` an `OrdersMessage`, which agents give as well.
"""

import re
from typing import Literal, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

from mapweave_protocol.errors import MessageError
from mapweave_protocol.wire.model import ComponentName, Count, Id

_NUMBER = re.compile(r"[0-9]{1,15}")
_COUNTED = {"version", "since", "limit"}
_EXPECTED = "version=N, since=N, since=N;limit=K, robot=ID, component=ID/K, runs=all, orders=all"


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
    component: ComponentName | None = Field(default=None)
    runs: Literal["all"] | None = Field(default=None)
    orders: Literal["all"] | None = Field(default=None)

    @model_validator(mode="after")
    def _check(self) -> Self:
        if len(self._given().keys() - {"limit"}) > 1:
            raise ValueError("expected one question")
        if self.limit is not None and self.since is None:
            raise ValueError("limit, expected beside since only")
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
