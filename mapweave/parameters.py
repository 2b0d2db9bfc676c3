"""Parameters of a stage: numbers that derive from the configuration, and constants beside them.

A number that is bound to the sensor, the robot or the map is written once, where it is used, as a
factor times the physical value::

    class IcpParameters(StageParameters):
        end_scale: float = derived(lambda c: 2 * c.sensor.range_sigma, gt=0, description="[m] …")

`StageParameters.of` makes the parameters that a configuration asks for. Without one, they are those
of the default configuration.
"""

from collections.abc import Callable
from typing import Generic, Self, TypeVar

from pydantic import BaseModel, ConfigDict, Field

from mapweave.config import Config

T = TypeVar("T")

_DEFAULTS = Config()


class StageParameters(BaseModel):
    """Base of the parameters of a stage that hang on the configuration."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    @classmethod
    def of(cls, config: Config, **given: object) -> Self:
        """Return the parameters for `config`; what is `given` by name does not derive from it."""
        derived_ones = {
            name: field.default_factory.formula(config)
            for name, field in cls.model_fields.items()
            if isinstance(field.default_factory, _Derivation)
        }
        return cls(**{**derived_ones, **given})


class _Derivation(Generic[T]):
    """Makes the default of a field: what its formula makes of the default configuration."""

    def __init__(self, formula: Callable[[Config], T]) -> None:
        self.formula = formula

    def __call__(self) -> T:
        return self.formula(_DEFAULTS)


def derived(
    formula: Callable[[Config], T],
    *,
    description: str | None = None,
    gt: float | None = None,
    ge: float | None = None,
    lt: float | None = None,
    le: float | None = None,
) -> T:
    """Return a field that `formula` derives from the configuration.

    Parameters
    ----------
    formula
        A factor times a physical value of the configuration; for the parameters of a stage within
        a stage, their `StageParameters.of`.
    description, gt, ge, lt, le
        As of a `pydantic.Field`.
    """
    factory = _Derivation(formula)
    field: T = Field(default_factory=factory, description=description, gt=gt, ge=ge, lt=lt, le=le)
    return field
