"""What a user may set: the sensor, the robot, and some ten numbers of mapping, as plain values.

All other numbers of mapweave derive from these, each as a factor times one of them, or are
constants beside their algorithm (`mapweave.parameters`). A file in TOML and the environment change
the defaults::

    [sensor]
    range_sigma = 0.03            # or MAPWEAVE_SENSOR_RANGE_SIGMA=0.03

The environment goes before the file, and the file before the defaults.
"""

import math
import reprlib
from collections import abc
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Annotated, NamedTuple, Self, TypeAlias

from annotated_types import Ge, Le
from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    PrivateAttr,
    ValidationError,
    model_validator,
)
from pydantic.fields import FieldInfo

from mapweave.config_sources import Given, in_environment, in_file
from mapweave.errors import ConfigError

Value: TypeAlias = float | int | list[list[float]] | None
"""Of a setting; None where it is not set and the scans tell."""

DEFAULT = "default"
"""Where a value comes from that nobody set."""


class Unit(NamedTuple):
    """What a setting is measured in; empty for counts and shares."""

    name: str


class Setting(NamedTuple):
    """One value of a configuration, with all that is known of it.

    Attributes
    ----------
    section, name
        Such as ``sensor`` and ``range_sigma``.
    value
        The one in force, in `unit`.
    description
        Half a sentence for a person.
    origin
        ``default``, the file or the variable that it comes from.
    """

    section: str
    name: str
    value: Value
    unit: str
    description: str
    origin: str


_Metres: TypeAlias = Annotated[float, Unit("m")]
_Radians: TypeAlias = Annotated[float, Unit("rad")]
_Share: TypeAlias = Annotated[float, Unit("")]
_Count: TypeAlias = Annotated[int, Unit("")]


def _tuples(value: object) -> object:
    """Return a list of lists, as files have it, as the tuples that it is checked to be."""
    if not isinstance(value, list):
        return value
    return tuple(tuple(each) if isinstance(each, list) else each for each in value)


_Direction: TypeAlias = Annotated[float, Field(ge=-360, le=360)]
_Sectors: TypeAlias = Annotated[
    tuple[tuple[_Direction, _Direction], ...], BeforeValidator(_tuples), Unit("°")
]


class _Checked(BaseModel):
    """Checked when it is made: what is wrong is a `ConfigError`, one line that names the field."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, allow_inf_nan=False)

    @model_validator(mode="wrap")
    @classmethod
    def _in_one_line(cls, values: object, check: Callable[[object], "_Checked"]) -> "_Checked":
        try:
            return check(values)
        except ValidationError as error:
            raise _first_problem(cls, error) from error


class Sensor(_Checked):
    """The laser."""

    range_sigma: _Metres = Field(
        0.02, ge=0.001, le=0.2, description="standard deviation of a reading"
    )
    max_range: Annotated[float | None, Unit("m")] = Field(
        None,
        ge=0.1,
        le=1000,
        description="readings at or beyond it are no returns; unset: as the log has it",
    )
    range_min: _Metres = Field(
        0.02,
        ge=0,
        le=100,
        description="nearer readings are no returns; some lidars write what went wrong so",
    )
    masks: _Sectors = Field(
        (),
        max_length=32,
        description="from one direction counter-clockwise to another, in which the sensor sees the"
        " robot itself: no returns",
    )
    angular_step: Annotated[float | None, Unit("rad")] = Field(
        None,
        ge=1e-4,
        le=0.2,
        description="between beams, where the log does not say (FLASER); unset: as its PARAM or"
        " their number suggests",
    )
    rate: Annotated[float | None, Unit("Hz")] = Field(
        None,
        ge=0.1,
        le=1000,
        description="scans a second, the fewest; unset: one, as in thinned logs",
    )

    @model_validator(mode="after")
    def _sees_something(self) -> Self:
        if self.max_range is not None and self.range_min >= self.max_range:
            raise ConfigError(
                "",
                "sensor.range_min",
                f"expected less than max_range, {self.max_range:g} m, found {self.range_min:g}:"
                " no reading would count",
            )
        return self

    @property
    def residual_sigma(self) -> float:
        """[m] of a point against the line it lies on: neighbouring returns err alike."""
        return 5 * self.range_sigma

    @property
    def interval(self) -> float:
        """[s] from a scan to the next, the longest."""
        return 1.0 if self.rate is None else 1 / self.rate


class Robot(_Checked):
    """How the robot moves."""

    max_speed: Annotated[float, Unit("m/s")] = Field(
        2.0, ge=0.01, le=20, description="it drives no faster"
    )
    max_turn_rate: Annotated[float, Unit("rad/s")] = Field(
        math.pi, ge=0.01, le=20, description="it turns no faster"
    )


class Mapping(_Checked):
    """How finely is mapped, and what counts as one place, one wall, one opening."""

    resolution: _Metres = Field(
        0.1, ge=0.02, le=1, description="of rasters, and between points on walls"
    )
    submap_length: _Metres = Field(
        12.0, ge=2, le=200, description="of path that finish a submap; drift inside is negligible"
    )
    submap_scans: _Count = Field(
        400, ge=10, le=100_000, description="placed scans that finish a submap"
    )
    patience: _Count = Field(
        5, ge=1, le=1000, description="scans in a row that fit nowhere until the robot is lost"
    )
    max_gap: _Metres = Field(
        0.5, ge=0.05, le=10, description="between segments of one generalized polyline"
    )
    door: _Metres = Field(
        0.6, ge=0.1, le=5, description="narrowest opening in a wall that must stay open"
    )
    clearance: _Metres = Field(
        0.3, ge=0.05, le=2, description="inside seen free space from which a wall contradicts"
    )
    closeness: _Metres = Field(0.25, ge=0.05, le=2, description="within which walls coincide")
    free_range: _Metres = Field(
        10.0, ge=1, le=200, description="up to which what beams pass through is free"
    )
    far_range: _Metres = Field(
        25.0, ge=1, le=500, description="up to which returns are aligned: the end of a corridor"
    )
    keyframe_step: _Metres = Field(
        0.3, ge=0.05, le=5, description="of motion until a scan is remembered for tracking"
    )
    keyframe_turn: _Radians = Field(
        0.26, ge=0.02, le=math.pi, description="of rotation until a scan is remembered: 15°"
    )
    min_confidence: _Share = Field(
        0.85, ge=0.5, le=0.999, description="of an alignment that is accepted"
    )


class Config(_Checked):
    """All that a user may set.

    Two of them are equal where their values are, wherever these come from.
    """

    sensor: Sensor = Sensor()
    robot: Robot = Robot()
    mapping: Mapping = Mapping()
    _origins: dict[str, str] = PrivateAttr(default_factory=dict)

    @classmethod
    def load(
        cls, file: str | Path | None = None, environ: abc.Mapping[str, str] | None = None
    ) -> "Config":
        """Return what a file and the environment make of the defaults.

        Parameters
        ----------
        file
            In TOML, a table for each section; None for no file.
        environ
            Variables such as ``MAPWEAVE_SENSOR_RANGE_SIGMA``, which go before the file. One that
            is empty says nothing.

        Raises
        ------
        ConfigError
            If the file cannot be read, or something in it or in the environment is unknown, of
            the wrong type or out of bounds.
        """
        given: dict[str, Given] = {}
        if file is not None:
            given.update(in_file(Path(file), _sections()))
        given.update(in_environment(environ or {}, _sections()))
        sections = {}
        for section, model in _sections().items():
            of_section = {k: v.value for k, v in given.items() if k.startswith(f"{section}.")}
            try:
                sections[section] = model.model_validate(
                    {name.partition(".")[2]: value for name, value in of_section.items()}
                )
            except ConfigError as error:
                raise ConfigError(given[error.field].origin, error.field, error.problem) from error
        config = cls.model_validate(sections)
        config._origins.update({name: each.origin for name, each in given.items()})
        return config

    def settings(self) -> Iterator[Setting]:
        """Yield every value, section by section."""
        for section, values in self.values().items():
            fields = _sections()[section].model_fields
            for name, value in values.items():
                origin = self._origins.get(f"{section}.{name}", DEFAULT)
                field = fields[name]
                yield Setting(section, name, value, _unit(field), field.description or "", origin)

    def values(self) -> dict[str, dict[str, Value]]:
        """Return the plain values, by section and name."""
        values: dict[str, dict[str, Value]] = self.model_dump(mode="json")
        return values

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Config) and self.values() == other.values()

    def __hash__(self) -> int:
        return hash((self.sensor, self.robot, self.mapping))


def _sections() -> dict[str, type[_Checked]]:
    return {"sensor": Sensor, "robot": Robot, "mapping": Mapping}


def _first_problem(model: type[_Checked], error: ValidationError) -> ConfigError:
    """Return what is wrong with the first field that is, and what was expected there."""
    problem = error.errors(include_url=False, include_context=False)[0]
    section, found = model.__name__.lower(), reprlib.repr(problem["input"])
    known = model.model_fields
    if not problem["loc"]:
        return ConfigError("", section, f"expected values of {', '.join(known)}, found {found}")
    name = str(problem["loc"][0])
    if name not in known:
        return ConfigError("", f"{section}.{name}", f"no such field; there are {', '.join(known)}")
    return ConfigError("", f"{section}.{name}", f"expected {_expected(known[name])}, found {found}")


def _expected(field: FieldInfo) -> str:
    """Return what a field takes, for a person: ``a number from 0.001 to 0.2 [m]``."""
    if _unit(field) == "°":
        return "pairs of directions from -360 to 360 [°], such as [[100, 140]]"
    low = [each.ge for each in field.metadata if isinstance(each, Ge)]
    high = [each.le for each in field.metadata if isinstance(each, Le)]
    kind = "a whole number" if field.annotation is int else "a number"
    bounds = f" from {low[0]} to {high[0]}" if low and high else ""
    return f"{kind}{bounds}" + (f" [{_unit(field)}]" if _unit(field) else "")


def _unit(field: FieldInfo) -> str:
    return next((each.name for each in field.metadata if isinstance(each, Unit)), "")
