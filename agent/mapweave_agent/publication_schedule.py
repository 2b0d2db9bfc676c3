"""How often a robot does what, and when its map is due; no clock and no network in here."""

from pydantic import BaseModel, ConfigDict, Field


class AgentParameters(BaseModel):
    """How often things are done; all by the wall clock."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    map_interval: float = Field(
        2.0, gt=0, description="[s] at most this often the growing submap is published"
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
    status_interval: float = Field(1.0, gt=0, description="[s] between statuses, as designed")


class PublicationSchedule:
    """When to publish the map: at once when a submap was finished, else at a bounded rate."""

    def __init__(self, interval: float) -> None:
        self._interval = interval
        self._last: float | None = None
        self._urgent = True

    def hurry(self) -> None:
        """Say that what changed is worth a message at once."""
        self._urgent = True

    def due(self, now: float) -> bool:
        """Tell whether a map that has changed is to be published."""
        return self._urgent or self._last is None or now - self._last >= self._interval

    def published(self, now: float) -> None:
        """Note that the map has been published."""
        self._last = now
        self._urgent = False
