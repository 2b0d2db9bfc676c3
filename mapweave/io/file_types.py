"""What the models of files have in common, and the kinds of names and numbers in them."""

from typing import Annotated, TypeAlias

from pydantic import BaseModel, ConfigDict, Field, StringConstraints

from mapweave.ids import ID_PATTERN, RUN_PATTERN

Count: TypeAlias = Annotated[int, Field(ge=0, le=2**53)]
# The bound keeps sums and squares of coordinates finite; no robot drives farther.
Metre: TypeAlias = Annotated[float, Field(ge=-1e6, le=1e6)]
Pose: TypeAlias = tuple[Metre, Metre, float]
RobotId: TypeAlias = Annotated[str, StringConstraints(pattern=ID_PATTERN)]
ComponentName: TypeAlias = Annotated[
    str, StringConstraints(pattern=RUN_PATTERN.removesuffix("$") + "/[0-9]{1,9}$")
]


class FileModel(BaseModel):
    """Part of a file; fields that are not known are ignored: a later version may add some."""

    model_config = ConfigDict(strict=True, frozen=True, extra="ignore", allow_inf_nan=False)
