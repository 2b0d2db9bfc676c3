"""The numbers of map fusion: one model for each stage."""

from functools import cache

from pydantic import Field

from mapweave.config import Config
from mapweave.fusion.confidence import ConfidenceParameters
from mapweave.fusion.decision import DecisionParameters
from mapweave.fusion.extrapolation import ExtrapolationParameters
from mapweave.fusion.places import PlaceParameters
from mapweave.fusion.rooms import RoomParameters
from mapweave.fusion.wings import WingParameters
from mapweave.geometry.arguments import check_kind
from mapweave.matching.distance_field import DistanceFieldParameters
from mapweave.matching.hypotheses import HypothesisParameters
from mapweave.matching.icp import IcpParameters
from mapweave.matching.verification import VerificationParameters
from mapweave.parameters import StageParameters, derived


class FusionParameters(StageParameters):
    """One model for each stage."""

    # Who stays longer in a room is not surer of which room it is.
    raster: DistanceFieldParameters = derived(
        lambda c: DistanceFieldParameters.of(c, same_wall=0.5)
    )
    hypotheses: HypothesisParameters = derived(HypothesisParameters.of)
    # Right transforms contradict next to nothing, wrong ones a metre in ten: at a weight of 5 the
    # right one scored highest for every pair of stretches with 10 m and more in common.
    verification: VerificationParameters = derived(
        lambda c: VerificationParameters.of(c, contradiction_weight=5.0, moved_weight=0.1)
    )
    icp: IcpParameters = derived(
        lambda c: IcpParameters.of(
            c, start_scale=0.25, end_scale=5 * c.sensor.range_sigma, shrink=0.6
        )
    )
    icp_samples: int = Field(250, ge=10, description="of a map's walls, aligning hypotheses")
    loose: float = Field(0.5, gt=0, description="[m] a hypothesis may be off, before alignment")
    confidence: ConfidenceParameters = ConfidenceParameters()
    rooms: RoomParameters = RoomParameters()
    wings: WingParameters = WingParameters()
    places: PlaceParameters = derived(
        lambda c: PlaceParameters.of(
            c, verification=VerificationParameters.of(c, contradiction_weight=5.0, moved_weight=0.1)
        )
    )
    decision: DecisionParameters = derived(DecisionParameters.of)
    reach: ExtrapolationParameters = ExtrapolationParameters()
    mirrored_wall: float = Field(
        30.0, gt=0, description="[m] in common of mirrored maps, from which they are told of"
    )
    mirrored_part: float = Field(
        0.5,
        gt=0,
        description="of that, what some shift of mirrored maps counts in wide cells at the least;"
        " of 187 joined pairs the right one counted 0.62",
    )
    min_wall: float = Field(4.0, gt=0, description="[m] of wall that a map has, to be compared")


def chosen(parameters: FusionParameters | None, config: Config | None) -> FusionParameters:
    """Return `parameters`, or else those that derive from `config`; ArgumentError if neither is."""
    if parameters is not None:
        check_kind("parameters", parameters, FusionParameters)
        return parameters
    if config is None:
        return _usual()
    check_kind("config", config, Config)
    return FusionParameters.of(config)


@cache
def _usual() -> FusionParameters:
    """Return those of the default configuration: making them takes a good part of a refusal."""
    return FusionParameters.of(Config())
