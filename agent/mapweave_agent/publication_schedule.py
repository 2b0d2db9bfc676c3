"""How often a robot does what, and when its map is due; no clock and no network in here."""

import math

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from mapweave.geometry.arrays import FloatArray

FRAME = (
    50  # [bytes] that Zenoh adds to a message: whose it is, its number, and that it was the last
)
MOST_SAVED = 1000.0  # [bytes], and most that is owed: a whole map now and then is no growth


class AgentParameters(BaseModel):
    """How often things are done; all by the wall clock."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    map_interval: float = Field(
        2.0, gt=0, description="[s] at most this often the growing submap is published, if driven"
    )
    state_interval: float = Field(
        1.5, gt=0, description="[s] at least this often the growing map is kept on disk"
    )
    leave_within: float = Field(
        3.0, ge=0, description="[s] that a coordinator is given to take the last map"
    )
    comparison_interval: float = Field(
        5.0, ge=0, description="[s] at most this often a pair is compared while it still maps"
    )
    comparison_rest: float = Field(
        2.0, ge=0, description="times as long as a comparison took, its pair rests while it maps"
    )
    comparison_patience: float = Field(
        60.0,
        ge=0,
        description="[s] that a pair whose shapes do not say that both saw one place lets others"
        " go first",
    )
    strangers: int = Field(
        12,
        ge=0,
        description="runs of others up to which all are compared, whatever their shapes say",
    )
    map_distance: float = Field(
        2.0, gt=0, description="[m] driven after which the growing submap is published"
    )
    map_patience: float = Field(
        10.0, gt=0, description="[s] after which it is published though less was driven"
    )
    bytes_per_metre: float = Field(
        50.0, gt=0, description="[1/m] of maps; settled submaps go first, growth waits for it"
    )
    bytes_per_second: float = Field(
        2.0,
        ge=0,
        description="[1/s] of maps besides: a place may change while it stands",
    )
    status_interval: float = Field(
        30.0,
        gt=0,
        description="[s] between statuses though nothing but progress is to be said, half of it"
        " while a peer's map is lacking; a slow robot drives 5 m meanwhile",
    )
    least_status_interval: float = Field(
        1.0, ge=0, description="[s] after a status before the next, whatever has changed"
    )


class PublicationSchedule:
    """When to publish the map: at once when a submap was finished, else as far as was driven."""

    def __init__(self, parameters: AgentParameters) -> None:
        self._parameters = parameters
        self._last: float | None = None
        self._driven = 0.0
        self._allowed = 0.0  # [bytes] that the way and the time allowed and no message has used
        self._size = 0  # [bytes] of the last growing submap
        self._at: tuple[int, FloatArray] | None = None
        self._urgent = True

    def moved(self, component: int, pose: FloatArray) -> None:
        """Take in where the robot is, ``(3,)`` [m, m, rad] in the frame of `component`."""
        if self._at is not None and self._at[0] == component:
            step = float(np.hypot(*(pose - self._at[1])[:2]))
            self._driven += step
            self._allowed += step * self._parameters.bytes_per_metre
        self._at = component, pose

    def hurry(self) -> None:
        """Say that what changed is worth a message at once."""
        self._urgent = True

    def due(self, now: float) -> bool:
        """Tell whether a map that has changed is to be published."""
        if self._urgent or self._last is None:
            return True
        p, waited = self._parameters, now - self._last
        if waited < p.map_interval or self._allowed + waited * p.bytes_per_second < self._size:
            return False
        return self._driven >= p.map_distance or waited >= p.map_patience

    def published(self, now: float, size: int = 0) -> None:
        """Note that the map has been published, in a payload of `size` [bytes]."""
        waited = 0.0 if self._last is None else now - self._last
        size += FRAME
        allowed = self._allowed + waited * self._parameters.bytes_per_second - size
        self._allowed = min(max(allowed, -MOST_SAVED), MOST_SAVED)
        if not self._urgent:
            self._size = size
        self._last = now
        self._driven = 0.0
        self._urgent = False


class RegularSchedule:
    """When to do what is to be done at a bounded rate."""

    def __init__(self, interval: float) -> None:
        self._interval = interval
        self._last = -math.inf

    def due(self, now: float) -> bool:
        """Tell whether it is time."""
        return now - self._last >= self._interval

    def done(self, now: float) -> None:
        """Note that it was done."""
        self._last = now
