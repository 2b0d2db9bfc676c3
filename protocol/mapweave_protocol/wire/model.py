"""What all messages have in common, and the kinds of names and numbers in them."""

import math
from typing import Annotated, ClassVar

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from mapweave.geometry.arrays import FloatArray
from mapweave.ids import ID_PATTERN, RUN_PATTERN

WORLD_REACH = 1e5  # [m] from a component's origin
JOINT_REACH = 1e9  # [m]; alignments within WORLD_REACH add up along a chain of components
MAX_COUNT = 2**53
MAX_ALIGNMENTS = 4096

Id = Annotated[str, Field(pattern=ID_PATTERN, max_length=32)]
Count = Annotated[int, Field(ge=0, le=MAX_COUNT)]
Probability = Annotated[float, Field(ge=0.0, le=1.0, allow_inf_nan=False)]
Number = Annotated[float, Field(ge=-1e12, le=1e12, allow_inf_nan=False)]


def _check_printable(text: str) -> str:
    """Refuse what would move the cursor of the terminal that shows it."""
    if not text.isprintable():
        raise ValueError("expected printable text")
    return text


Label = Annotated[str, Field(min_length=1, max_length=64), AfterValidator(_check_printable)]
Sentence = Annotated[str, Field(max_length=500), AfterValidator(_check_printable)]
ComponentName = Annotated[str, Field(pattern=RUN_PATTERN[:-1] + "/(0|[1-9][0-9]{0,4})$")]
# A whole turn, as nobody promises that a sum of two angles was wrapped.
Angle = Annotated[float, Field(ge=-2 * math.pi, le=2 * math.pi, allow_inf_nan=False)]
Metres = Annotated[float, Field(ge=-WORLD_REACH, le=WORLD_REACH, allow_inf_nan=False)]
JointMetres = Annotated[float, Field(ge=-JOINT_REACH, le=JOINT_REACH, allow_inf_nan=False)]
Transform = tuple[Metres, Metres, Angle]
JointTransform = tuple[JointMetres, JointMetres, Angle]


class WireModel(BaseModel):
    """Part of a message: exactly these fields, of exactly these types."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)


class Message(WireModel):
    """A message; `format` names it and the version of its layout."""

    format: ClassVar[str]


def to_transform(pose: FloatArray) -> Transform:
    """Return the ``(3,)`` `pose` [m, m, rad] as plain numbers."""
    x, y, theta = (float(number) for number in pose)
    return x, y, theta
