"""What all messages have in common, and the kinds of names and numbers in them."""

from typing import Annotated, ClassVar

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from mapweave.arrays import FloatArray
from mapweave.names import ID_PATTERN

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
ComponentName = Annotated[str, Field(pattern=ID_PATTERN[:-1] + "/(0|[1-9][0-9]{0,4})$")]
Transform = tuple[Number, Number, Number]


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
