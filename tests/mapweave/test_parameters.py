"""The numbers of the stages derive from the configuration; the default one gives those measured."""

import importlib
import math
import pkgutil
from typing import Any, get_args

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

import mapweave
from mapweave.config import Config, Mapping, Robot, Sensor
from mapweave.fusion.align import FusionParameters
from mapweave.mapping.mapper import Mapper, MapperParameters
from mapweave.mapping.tracking.observation import ObservationParameters, observe
from mapweave.mapping.tracking.tracker import TrackerParameters
from mapweave.matching.icp import IcpParameters
from mapweave.parameters import StageParameters
from mapweave.scan.scan import Scan
from mapweave.team.joining import JointParameters
from mapweave.team.joint_optimization import JointOptimizationParameters
from tests.mapweave.buildings import AROUND, BUILDING, cast, walls_of
from tests.mapweave.test_config import bounds

for module in pkgutil.walk_packages(mapweave.__path__, "mapweave."):
    if not module.name.endswith("__main__"):
        importlib.import_module(module.name)
STAGES = sorted(StageParameters.__subclasses__(), key=lambda stage: stage.__name__)
WHOLES: list[type[StageParameters]] = [
    MapperParameters,
    FusionParameters,
    JointParameters,
    JointOptimizationParameters,
]

# What the results of the benchmarks were measured with.
MEASURED: dict[str, dict[str, object]] = {
    "AlignmentGraphParameters": {},
    "BackendParameters": {"spacing": 0.1},
    "ChangeDetectionParameters": {"spacing": 0.1, "clearance": 0.3, "sight": 10.0},
    "CoarsePlaceParameters": {"width": 0.4, "closeness": 0.3125, "clearance": 0.5},
    "ComponentMergingParameters": {},
    "ContradictionParameters": {},
    "CorrelativeParameters": {"cell": 0.1, "reach": 1.2},
    "CoverageParameters": {"reach": 0.35, "tolerance": 0.1},
    "DecisionParameters": {"min_confidence": 0.85},
    "DistanceFieldParameters": {"cell": 0.1, "spacing": 0.2},
    "DriftParameters": {"shift": 0.5, "reach": 0.15, "forgotten": 0.05},
    "EncounterParameters": {},
    "FaintSurfaceParameters": {"sight": 10.0, "cell": 0.05},
    "FftCorrelationParameters": {"clearance": 0.5},
    "FittingParameters": {"tolerance": 0.09, "max_hole": 0.3},
    "FragmentParameters": {},
    "FreeSpaceParameters": {"sight": 10.0, "margin": 0.15, "cell": 0.05, "simplification": 0.1},
    "FusionParameters": {},
    "GapParameters": {"reach": 3.0, "max_reach": 7.5},
    "HypothesisParameters": {},
    "IcpParameters": {"end_scale": 0.04, "noise": 0.1},
    "JoiningParameters": {"max_overhang": 0.12, "max_shift": 0.03, "max_crossing": 0.1},
    "JointOptimizationParameters": {},
    "JointParameters": {"max_gap": 0.5},
    "KidnapDetectionParameters": {"closeness": 0.25, "clearance": 0.3, "sight": 12.0},
    "LeapParameters": {},
    "LocalMapParameters": {
        "thin": 0.02,
        "keyframe_step": 0.3,
        "keyframe_turn": 0.26,
        "overlap": 0.15,
        "clearance": 0.3,
        "sight": 12.0,
        "far_sight": 25.0,
    },
    "LocalizerParameters": {},
    "LoopParameters": {"reach": 12.0, "residual": 0.15},
    "MapperParameters": {"patience": 5},
    "MergingParameters": {"max_step": 0.12, "max_gap": 0.3, "end_noise": 0.05, "max_shift": 0.03},
    "MultiviewIcpParameters": {"scales": (0.15, 0.1, 0.06, 0.04, 0.04), "noise": 0.1},
    "ObservationParameters": {
        "max_range": math.inf,
        "min_range": 0.02,
        "masks": (),
        "max_gap": 0.5,
        "spacing": 0.2,
        "loose_gap": 0.25,
        "sight": 25.0,
    },
    "OwnBodyParameters": {"still": 0.06, "moved": 0.1, "edge": 0.25, "depth": 0.1},
    "PlaceFinderParameters": {},
    "PlaceIndexParameters": {},
    "PlaceParameters": {"radius": 18.0, "one_place": 48.0},
    "PlaceRecognitionParameters": {},
    "PoseCovarianceParameters": {"noise": 0.1},
    "ReachabilityParameters": {
        "max_speed": 2.0,
        "max_turn_rate": np.pi,
        "slack": 0.25,
        "turn_slack": 0.26,
    },
    "RecentScansParameters": {"step": 0.3, "turn": 0.26},
    "ScanFinderParameters": {"explained": 0.15, "roughly": 0.2},
    "SegmentConfidenceParameters": {"spacing": 0.2, "closeness": 0.3, "clearance": 0.3},
    "SegmentationParameters": {"max_range": 30.0, "tolerance": 0.04},
    "SelectionParameters": {"tolerance": 0.09},
    "SimplificationParameters": {"spacing": 0.1},
    "SliverParameters": {"max_distance": 0.15},
    "StandingThingsParameters": {"near": 0.15, "clearance": 0.3, "sight": 12.0},
    "StraighteningParameters": {"max_bend": 0.04, "max_crossing": 0.1},
    "SubmapParameters": {
        "length": 12.0,
        "max_scans": 400,
        "max_gap": 0.5,
        "free_space_turn": 0.26,
    },
    "SweepParameters": {"reach": 0.06},
    "TrackerParameters": {
        "line_spacing": 0.1,
        "max_step": 2.5,
        "first_window": 1.15,
    },
    "VerificationParameters": {"closeness": 0.25, "clearance": 0.3},
    "WallEndParameters": {"max_overhang": 0.12, "max_crossing": 0.1},
    "WhereaboutsParameters": {
        "max_speed": 2.0,
        "max_turn_rate": math.pi,
        "slack": 0.5,
        "turn_slack": 0.26,
        "untold": 3.0,
        "farthest": 15.0,
    },
}


def derived_numbers(stage: type[StageParameters]) -> dict[str, object]:
    """Return what a stage derives from the default configuration, but for stages within it."""
    made = stage.of(Config())
    return {
        name: getattr(made, name)
        for name, field in stage.model_fields.items()
        if field.default_factory is not None
        and not isinstance(getattr(made, name), StageParameters)
    }


def test_every_stage_that_hangs_on_the_configuration_is_listed_here() -> None:
    assert [stage.__name__ for stage in STAGES] == list(MEASURED)


@pytest.mark.parametrize("stage", STAGES)
def test_the_default_configuration_gives_the_numbers_that_were_measured(
    stage: type[StageParameters],
) -> None:
    assert derived_numbers(stage) == MEASURED[stage.__name__]  # to the last bit


@pytest.mark.parametrize("stage", STAGES)
def test_parameters_without_a_configuration_are_those_of_the_default_one(
    stage: type[StageParameters],
) -> None:
    assert stage.of(Config()) == stage()


def test_stages_within_a_stage_keep_what_is_their_own() -> None:
    mapping, fusion = MapperParameters.of(Config()).backend, FusionParameters.of(Config())
    joint, weaving = JointParameters.of(Config()), JointOptimizationParameters.of(Config())
    scales = [(p.start_scale, p.end_scale) for p in (mapping.loops.icp, fusion.icp)]
    assert scales == [(0.4, 0.05), (0.25, 0.1)] and fusion.icp.shrink == 0.6
    assert fusion.verification.contradiction_weight == 5.0
    assert (mapping.loops.hypotheses.count, mapping.loops.hypotheses.distance) == (3, 0.6)
    assert mapping.component_merging.fusion.decision.plain_held == math.inf
    simplification = mapping.submap.simplification
    assert simplification.placement.tolerance == simplification.selection.tolerance == 0.07
    assert simplification.selection.price == 0.03
    assert (joint.merging.max_step, joint.merging.max_cost) == (0.25, 0.2)
    loops = weaving.loops
    assert (loops.min_drift, loops.min_turn, loops.remembered) == (0.9, 0.1, 128)


@pytest.mark.parametrize(("section", "name"), [
    (section, name)
    for section, model in (("sensor", Sensor), ("robot", Robot), ("mapping", Mapping))
    for name in model.model_fields
    if name != "angular_step"  # read by the readers of logs
])  # fmt: skip
def test_every_setting_changes_a_number_of_some_stage(section: str, name: str) -> None:
    default = getattr(getattr(Config(), section), name)
    others = {"masks": ((100.0, 140.0),), "range_min": 0.2}
    if name in others:
        other = others[name]
    else:
        lower = default is not None and type(default)(default * 0.9 if default < 1 else default - 1)
        other = 8.0 if default is None else lower
    changed = Config.model_validate({section: {name: other}})
    assert any(stage.of(changed) != stage.of(Config()) for stage in WHOLES)


def test_a_noisier_sensor_loosens_alignment_segments_and_merging_alike() -> None:
    twice = MapperParameters.of(Config(sensor=Sensor(range_sigma=0.04)))
    assert twice.tracker.local_map.icp == IcpParameters(end_scale=0.08, noise=0.2)
    assert twice.observation.segments.tolerance == 0.08
    assert twice.uncertainty.noise == twice.backend.refinement.noise == 0.2
    assert twice.backend.submap.merging.max_step == 0.24
    assert twice.backend.submap.simplification.placement.tolerance == 0.14
    assert twice.backend.submap.slivers.max_distance == 0.3


def test_a_faster_sensor_or_a_slower_robot_narrows_what_is_searched() -> None:
    default, faster = TrackerParameters(), TrackerParameters.of(Config(sensor=Sensor(rate=10)))
    slower = TrackerParameters.of(Config(robot=Robot(max_speed=0.2, max_turn_rate=math.pi / 10)))
    for one in (faster, slower):
        assert one.max_step == pytest.approx(0.7)
        assert one.local_map.search.reach == pytest.approx(0.3)
        assert one.first_window == pytest.approx(default.first_window / 10)


def test_no_more_than_a_whole_turn_and_the_raster_are_searched() -> None:
    fast = Config(sensor=Sensor(rate=0.1), robot=Robot(max_speed=20, max_turn_rate=20))
    p = TrackerParameters.of(fast)
    assert p.first_window == np.pi
    assert p.local_map.search.reach < p.local_map.search.half_width


def test_the_clearance_is_one_number_wherever_free_space_is_asked() -> None:
    c = Config(mapping=Mapping(clearance=0.4))
    mapper, fusion, joint = MapperParameters.of(c), FusionParameters.of(c), JointParameters.of(c)
    assert {
        mapper.backend.kidnapping.clearance,
        mapper.backend.loops.verification.clearance,
        mapper.backend.submap.change_detection.clearance,
        mapper.tracker.local_map.clearance,
        fusion.verification.clearance,
        joint.segments.clearance,
        joint.graph.contradictions.verification.clearance,
    } == {0.4}


def test_what_is_given_by_name_does_not_derive_from_the_configuration() -> None:
    p = IcpParameters.of(Config(sensor=Sensor(range_sigma=0.1)), end_scale=0.01)
    assert (p.end_scale, p.noise) == (0.01, 0.5)
    with pytest.raises(ValidationError, match="scale"):
        IcpParameters.of(Config(), scale=0.01)


def configurations() -> st.SearchStrategy[Config]:
    """Any configuration within its bounds."""

    def of(model: type[Sensor | Robot | Mapping]) -> st.SearchStrategy[dict[str, Any]]:
        values: dict[str, st.SearchStrategy[Any]] = {}
        for name, field in model.model_fields.items():
            if name == "masks":
                direction = st.floats(-360, 360)
                values[name] = st.lists(st.tuples(direction, direction), max_size=3)
                continue
            low, high = bounds(field)
            numbers: st.SearchStrategy[Any] = (
                st.integers(int(low), int(high))
                if field.annotation is int
                else st.floats(low, high)
            )
            unset = type(None) in get_args(field.annotation)
            values[name] = st.none() | numbers if unset else numbers
        return st.fixed_dictionaries(values)

    def seeing(sensor: dict[str, Any]) -> dict[str, Any]:
        """Return `sensor` so that readings can count."""
        farthest = sensor["max_range"]
        return (
            sensor
            if farthest is None
            else {**sensor, "range_min": min(sensor["range_min"], farthest / 2)}
        )

    return st.fixed_dictionaries(
        {"sensor": of(Sensor).map(seeing), "robot": of(Robot), "mapping": of(Mapping)}
    ).map(Config.model_validate)


@settings(max_examples=30, deadline=None)
@given(configurations())
def test_every_configuration_within_its_bounds_gives_parameters_within_theirs(
    config: Config,
) -> None:
    for stage in WHOLES:
        assert isinstance(stage.of(config), stage)


def test_readings_at_or_beyond_the_sensors_range_are_no_returns() -> None:
    scan = cast(walls_of(BUILDING), [9, 1, 0.3], angles=AROUND)
    reach = float(np.nanmedian(scan.ranges))
    short = ObservationParameters.of(Config(sensor=Sensor(max_range=reach)))
    seen = observe(scan, short).scan
    np.testing.assert_array_equal(seen.hits, scan.ranges < reach)
    np.testing.assert_array_equal(seen.ranges[seen.hits], scan.ranges[seen.hits])
    assert observe(scan, ObservationParameters()).scan is scan


def test_readings_nearer_than_the_sensors_least_range_are_no_returns() -> None:
    scan = cast(walls_of(BUILDING), [9, 1, 0.3], angles=AROUND)
    near = float(np.nanmedian(scan.ranges))
    seen = observe(scan, ObservationParameters.of(Config(sensor=Sensor(range_min=near)))).scan
    np.testing.assert_array_equal(seen.hits, scan.ranges >= near)
    np.testing.assert_array_equal(seen.ranges[seen.hits], scan.ranges[seen.hits])


def test_readings_within_two_centimetres_are_codes_of_what_went_wrong_unless_it_is_said() -> None:
    ranges = np.array([2.0, 0.007, 2.0, 0.019, 2.0, 0.02, 2.0, 2.0, 2.0, 2.0])
    scan = Scan(ranges, np.linspace(-0.2, 0.2, 10))
    seen = observe(scan, ObservationParameters.of(Config())).scan
    np.testing.assert_array_equal(seen.hits, ranges >= 0.02)
    told = observe(scan, ObservationParameters.of(Config(sensor=Sensor(range_min=0.0)))).scan
    assert told.hits.all()


@pytest.mark.parametrize(
    ("mask", "masked"),
    [((100, 140), (100, 140)), ((-170, -100), (-170, -100)), ((190, 260), (-170, -100)),
     ((0, 0), (0, 0)), ((-180, 180), (-180, 180)), ((-20, -10), (-20, -10))],
)  # fmt: skip
def test_where_the_sensor_is_masked_nothing_came_back(
    mask: tuple[float, float], masked: tuple[float, float]
) -> None:
    scan = cast(walls_of(BUILDING), [9, 1, 0.3], angles=AROUND + 1e-9)
    seen = observe(scan, ObservationParameters.of(Config(sensor=Sensor(masks=(mask,))))).scan
    degrees = np.round(np.degrees(scan.angles))
    inside = (degrees > masked[0]) & (degrees < masked[1])
    outside = (degrees < masked[0]) | (degrees > masked[1])
    assert not seen.hits[inside].any()
    np.testing.assert_array_equal(seen.ranges[outside], scan.ranges[outside])


def test_a_mask_over_half_a_turn_goes_counter_clockwise_from_its_first_direction() -> None:
    scan = cast(walls_of(BUILDING), [9, 1, 0.3], angles=AROUND)
    sensor = Sensor(masks=((140, 100), (0, 10)))
    seen = observe(scan, ObservationParameters.of(Config(sensor=sensor))).scan
    degrees = np.degrees(scan.angles)
    assert not seen.hits[(degrees < 99.5) | (degrees > 140.5)].any()
    np.testing.assert_array_equal(seen.hits[281:320], scan.hits[281:320])  # 101° to 139°


def walk(step: float, count: int, rng: np.random.Generator) -> list[Scan]:
    """Return scans along the corridor, `step` [m] apart."""
    walls = walls_of(BUILDING)
    return [
        cast(walls, [4 + step * k, 1, 0.02 * k], index=k, angles=AROUND, noise=rng)
        for k in range(count)
    ]


def test_a_robot_is_followed_with_a_configuration_of_its_own(rng: np.random.Generator) -> None:
    config = Config(
        sensor=Sensor(rate=10, range_sigma=0.03, max_range=12), robot=Robot(max_speed=1)
    )
    mapper = Mapper("r1", config=config)
    for scan in walk(0.1, 20, rng):
        mapper.add(scan)
    robot_map = mapper.finish()
    assert robot_map.components == [0] and len(robot_map.submaps[0].trajectory.scan_index) == 20
    assert robot_map.made_with is not None
    assert robot_map.made_with.config == config.values()


def test_what_is_faster_than_the_robot_can_be_is_not_believed(rng: np.random.Generator) -> None:
    slow = Config(sensor=Sensor(rate=10), robot=Robot(max_speed=0.5))
    placed = {}
    for name, config in {"slow": slow, "default": Config()}.items():
        mapper = Mapper("r1", config=config)
        placed[name] = [mapper.add(scan).placed for scan in walk(1.0, 3, rng)]
    assert placed == {"slow": [True, False, False], "default": [True, True, True]}


def test_a_map_of_other_parameters_does_not_say_that_the_configuration_made_it() -> None:
    assert Mapper("r1", parameters=MapperParameters(patience=2)).robot_map().made_with is None
    assert Mapper("r1", parameters=MapperParameters()).robot_map().made_with is not None
