"""What all messages have in common, and the kinds of names and numbers in them."""

import math
from collections.abc import Mapping, Sequence
from typing import Annotated, ClassVar

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator

from mapweave.geometry.arrays import FloatArray
from mapweave.ids import ID_PATTERN, RUN_PATTERN
from mapweave_protocol.wire.budget import Budget

WORLD_REACH = 1e5  # [m] from a component's origin
ORDER_REACH = WORLD_REACH / 2  # [m] that is ordered: from a scan's pose it is within the other
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
WholeStep = Annotated[int, Field(ge=-(10**8), le=10**8)]  # [mm], as WORLD_REACH
Transform = tuple[Metres, Metres, Angle]
JointTransform = tuple[JointMetres, JointMetres, Angle]


class WireModel(BaseModel):
    """Part of a message: exactly these fields, of exactly these types.

    On the wire it is an array of the values, in the order of the fields; those at the end that are
    as by default may be left off. So is a dictionary whose names are known (`placed`).
    """

    # Digests are any bytes; in JSON they are told in hexadecimal digits.
    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, ser_json_bytes="hex")

    @model_validator(mode="before")
    @classmethod
    def _of_values(cls, fields: object) -> object:
        if not isinstance(fields, tuple):
            return fields
        if len(fields) > len(cls.names):
            raise ValueError(f"{len(fields)} values, expected at most {len(cls.names)}")
        named = dict(zip(cls.names, fields, strict=False))
        for name in cls.placed.keys() & named.keys():
            named[name] = by_name(cls.placed[name], named[name])
        return named

    placed: ClassVar[Mapping[str, Sequence[str]]] = {}
    """By field that is a dictionary, the names in it that need not travel."""

    names: ClassVar[tuple[str, ...]] = ()
    """Of the fields, in their order: a message is hundreds of models, and asking takes longer."""

    @classmethod
    def __pydantic_init_subclass__(cls, **kwargs: object) -> None:
        """Note the names of the fields of a model that is defined."""
        super().__pydantic_init_subclass__(**kwargs)
        cls.names = tuple(cls.model_fields)

    def values(self) -> tuple[object, ...]:
        """Return the values of the fields, in their order, as they travel."""
        fields = type(self).model_fields.items()
        values = [(name, getattr(self, name), field) for name, field in fields]
        while values and not values[-1][2].is_required():
            _, value, field = values[-1]
            if value != field.get_default(call_default_factory=True):
                break
            values.pop()
        return tuple(
            _plain(by_place(self.placed[name], value) if name in self.placed else value)
            for name, value, _ in values
        )


class Message(WireModel):
    """A message; `letter` tells on the wire which, `format` in words; `budget` bounds it."""

    letter: ClassVar[bytes]
    format: ClassVar[str]
    budget: ClassVar[Budget]


def to_transform(pose: FloatArray) -> Transform:
    """Return the ``(3,)`` `pose` [m, m, rad] as plain numbers, of no more digits than matter."""
    x, y, theta = (float(number) for number in pose)
    return round(x, 4), round(y, 4), round(theta, 6)


def by_place(names: Sequence[str], known: Mapping[str, object]) -> object:
    """Return what is `known` as it travels: each at the place of its name in `names`.

    Nothing stands where nothing is known; under other names all of it travels by name.
    """
    if not known or not known.keys() <= set(names):
        return dict(known)
    last = max(names.index(name) for name in known)
    return tuple(known.get(name) for name in names[: last + 1])


def by_name(names: Sequence[str], travelled: object) -> object:
    """Return what `by_place` gave by name; anything else as it is."""
    if not isinstance(travelled, tuple) or len(travelled) > len(names):
        return travelled
    pairs = zip(names, travelled, strict=False)
    return {name: value for name, value in pairs if value is not None}


def _plain(value: object) -> object:
    """Return `value` with models as their values, whole floats as integers, others shortened."""
    if isinstance(value, str | int):  # most of what a message holds
        return value
    if isinstance(value, float):
        return int(value) if value.is_integer() and abs(value) < MAX_COUNT else value
    if isinstance(value, tuple):
        return tuple([_plain(item) for item in value])
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    return value.values() if isinstance(value, WireModel) else value
