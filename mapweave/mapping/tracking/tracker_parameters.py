"""What a tracker is set by: the parameters of its parts, and its own."""

import numpy as np
from pydantic import Field

from mapweave.mapping.tracking.acceptance import AcceptanceParameters
from mapweave.mapping.tracking.drift import DriftParameters
from mapweave.mapping.tracking.local_map import LocalMapParameters
from mapweave.mapping.tracking.motion_model import MotionModelParameters
from mapweave.mapping.tracking.reachability import ReachabilityParameters
from mapweave.parameters import StageParameters, derived
from mapweave.shape.correspondence import CorrespondenceParameters


class TrackerParameters(StageParameters):
    """What the tracker remembers, expects and accepts."""

    local_map: LocalMapParameters = derived(LocalMapParameters.of)
    correspondence: CorrespondenceParameters = CorrespondenceParameters()
    motion_model: MotionModelParameters = MotionModelParameters()
    acceptance: AcceptanceParameters = AcceptanceParameters()
    reachability: ReachabilityParameters = derived(ReachabilityParameters.of)
    drift: DriftParameters = derived(DriftParameters.of)
    line_spacing: float = derived(
        lambda c: c.mapping.resolution, gt=0, description="[m] between points on the map's lines"
    )
    min_solid: float = Field(
        0.3,
        ge=0,
        le=1,
        description="share of the returns on walls, to do without things that may move: in a hall"
        " full of them they are all there is",
    )
    often: float = Field(
        1.0, gt=0, description="[s] from scan to scan, at the most, to do without them"
    )
    max_points: int = Field(180, ge=10, description="of a scan, in the alignment")
    max_step: float = derived(
        lambda c: 0.5 + c.robot.max_speed * c.sensor.interval,
        gt=0,
        description="[m] between scans that are tracked: driven, and 0.5 m for poses that err",
    )
    promising: float = Field(
        0.6, ge=0, le=1, description="of the best start's support that another must have early"
    )
    prior_sigma: float = Field(0.5, gt=0, description="[m] of a prediction, in the alignment")
    prior_turn: float = Field(0.35, gt=0, description="[rad] the same for the turn")
    open_novelty: float = Field(
        0.8, ge=0, le=1, description="what a return at a new place counts along bare walls"
    )
    widest: float = Field(
        4.0, gt=0, description="[m] searched each way, at the most: a keyframe log's longest steps"
    )
    open_step: float = Field(0.2, gt=0, description="[m] between places tried")
    first_window: float = derived(
        lambda c: min(np.pi, 1.15 / np.pi * c.robot.max_turn_rate * c.sensor.interval),
        gt=0,
        description="[rad] half the rotation searched first",
    )
    min_points: int = Field(20, ge=3, description="a scan with fewer oriented points is blind")
