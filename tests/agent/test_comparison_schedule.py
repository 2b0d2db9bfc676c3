"""Who compares what, when: no clock, no network."""

from dataclasses import dataclass, field, replace

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from mapweave.maps import Alignment, Decision, LineMap, RobotMap, Submap, Trajectory
from mapweave.reasons import Reason
from mapweave_agent.comparison_schedule import Comparison, ComparisonSchedule
from mapweave_agent.publication_schedule import (
    AgentParameters,
    PublicationSchedule,
)
from mapweave_protocol.link.lacking import GRACE
from mapweave_protocol.wire.joint_status_message import Place
from mapweave_protocol.wire.messages import (
    AlignmentMessage,
    Compared,
    JointStatusMessage,
    MapVersion,
)
from mapweave_protocol.wire.pairs import responsible
from tests.mapweave.buildings import BUILDING, part

PARAMETERS = AgentParameters(comparison_interval=5.0, comparison_rest=2.0)
FIRST = responsible("a", "b")
SECOND = "b" if FIRST == "a" else "a"
PEERS = [n for n in "stuvwxyz" if responsible("r", n) == "r"][:2]
ELSEWHERE = part(np.array([[0.0, 0.0], [9.0, 0.0], [4.0, 7.0]]), -1.0, 20.0)  # no right angle


def a_map(robot: str, version: int, boot: str = "x") -> RobotMap:
    return RobotMap(robot, boot, version, ())


def plan_of(robot: str, peer: str) -> ComparisonSchedule:
    plan = ComparisonSchedule(robot, PARAMETERS)
    plan.own_map(a_map(robot, 1), finished=False)
    plan.peer_here(peer, "x")
    plan.peer_map(a_map(peer, 1))
    return plan


def alignment(decision: Decision) -> Alignment:
    return Alignment("a/0", "b/0", np.zeros(3), decision, 0.5, Reason.words("so"))


def found(comparison: Comparison, author: str, *alignments: Alignment) -> AlignmentMessage:
    versions = MapVersion.of(comparison.reference), MapVersion.of(comparison.other)
    return AlignmentMessage.pack(author, *versions, alignments)


def test_of_two_only_the_responsible_one_compares() -> None:
    assert plan_of(FIRST, SECOND).begin(0.0) is not None
    assert plan_of(SECOND, FIRST).begin(0.0) is None


def test_the_smaller_id_is_the_reference_whoever_compares() -> None:
    for robot, peer in (("a", "b"), ("b", "a")):
        plan = plan_of(robot, peer)
        plan.peer_gone(peer, "x")
        comparison = plan.begin(0.0)
        assert comparison is not None
        assert (comparison.reference.robot, comparison.other.robot) == ("a", "b")


def test_when_the_responsible_one_is_gone_the_other_takes_over() -> None:
    plan = plan_of(SECOND, FIRST)
    plan.peer_gone(FIRST, "x")
    assert plan.begin(0.0) is not None


def test_nobody_takes_over_from_one_whose_token_is_still_to_come() -> None:
    plan = ComparisonSchedule(SECOND, PARAMETERS)
    plan.own_map(a_map(SECOND, 1), finished=False)
    plan.peer_map(a_map(FIRST, 1))
    assert plan.begin(0.0) is None


def test_nobody_takes_over_while_another_run_is_alive() -> None:
    plan = plan_of(SECOND, FIRST)
    plan.peer_here(FIRST, "y")
    plan.peer_gone(FIRST, "x")
    assert plan.begin(0.0) is None


def test_what_the_one_who_is_gone_had_compared_is_not_compared_again() -> None:
    first, second = plan_of(FIRST, SECOND), plan_of(SECOND, FIRST)
    comparison = first.begin(0.0)
    assert comparison is not None
    second.learned(found(comparison, FIRST))
    second.peer_gone(FIRST, "x")
    assert second.begin(0.0) is None
    second.own_map(a_map(SECOND, 2), finished=False)
    assert second.begin(0.0) is not None


def test_what_was_found_of_our_run_before_this_one_spares_us_nothing() -> None:
    before, now = plan_of(FIRST, SECOND), plan_of(SECOND, FIRST)
    comparison = before.begin(0.0)
    assert comparison is not None
    now.own_map(a_map(SECOND, 1, boot="later"), finished=False)
    now.learned(found(comparison, FIRST, alignment("accepted")))
    now.peer_gone(FIRST, "x")
    anew = now.begin(0.0)
    assert anew is not None
    assert not now.have_met(anew)


def test_the_same_versions_are_compared_once() -> None:
    plan = plan_of(FIRST, SECOND)
    comparison = plan.begin(0.0)
    assert comparison is not None
    plan.done(comparison, 1.0, 1.0)
    assert plan.begin(1e9) is None
    assert plan.idle
    assert plan.published == {SECOND: Compared(own_version=1, peer_boot="x", peer_version=1)}


def test_robots_that_were_joined_once_have_met_whoever_found_it() -> None:
    for robot, peer in ((FIRST, SECOND), (SECOND, FIRST)):
        for learns in (True, False):
            plan = plan_of(robot, peer)
            plan.peer_gone(peer, "x")
            comparison = plan.begin(0.0)
            assert comparison is not None
            assert not plan.have_met(comparison)
            if learns:
                plan.learned(found(comparison, peer, alignment("accepted")))
            else:
                plan.done(comparison, 1.0, 1.0, [alignment("accepted")])
            plan.done(comparison, 2.0, 1.0, [alignment("refused")])
            assert plan.have_met(comparison)


def test_robots_that_were_not_joined_have_not_met() -> None:
    plan = plan_of(FIRST, SECOND)
    comparison = plan.begin(0.0)
    assert comparison is not None
    plan.done(comparison, 1.0, 1.0, [alignment("ambiguous"), alignment("refused")])
    plan.done(comparison, 1.0, 1.0)
    assert not plan.have_met(comparison)


def test_who_met_another_run_of_a_robot_has_not_met_this_one() -> None:
    plan = plan_of(FIRST, SECOND)
    comparison = plan.begin(0.0)
    assert comparison is not None
    plan.done(comparison, 1.0, 1.0, [alignment("accepted")])
    plan.peer_map(a_map(SECOND, 1, boot="y"))
    anew = plan.begin(1e9)
    assert anew is not None
    assert not plan.have_met(anew)


def test_while_robots_map_a_pair_rests_between_comparisons() -> None:
    plan = plan_of(FIRST, SECOND)
    comparison = plan.begin(0.0)
    assert comparison is not None
    plan.done(comparison, now=10.0, took=4.0)
    plan.own_map(a_map(FIRST, 2), finished=False)
    assert plan.begin(17.9) is None
    assert not plan.idle
    assert plan.begin(18.0) is not None


def test_the_last_maps_are_compared_at_once() -> None:
    plan = plan_of(FIRST, SECOND)
    comparison = plan.begin(0.0)
    assert comparison is not None
    plan.done(comparison, now=1.0, took=1.0)
    plan.own_map(a_map(FIRST, 9), finished=True)
    plan.peer_map(a_map(SECOND, 7))
    assert plan.begin(1.0) is None
    plan.peer_finished(SECOND, "x", 7)
    last = plan.begin(1.0)
    assert last is not None
    assert {m.robot: m.version for m in (last.reference, last.other)} == {FIRST: 9, SECOND: 7}


def test_the_map_of_another_run_is_compared_anew() -> None:
    plan = plan_of(FIRST, SECOND)
    comparison = plan.begin(0.0)
    assert comparison is not None
    plan.done(comparison, 1.0, 1.0)
    plan.peer_map(a_map(SECOND, 1, boot="y"))
    assert plan.begin(1e9) is not None


def a_run(robot: str, component: int, boot: str) -> RobotMap:
    submap = Submap(0, component, np.zeros(3), LineMap.empty(), Trajectory.empty())
    return RobotMap(robot, boot, 1, (submap,))


def test_a_run_is_compared_with_the_one_before_it_once_for_each_of_its_maps() -> None:
    plan = ComparisonSchedule("a", PARAMETERS)
    earlier, own = a_run("a", 0, "before"), a_run("a", 1, "now")
    plan.earlier_map(earlier)
    plan.own_map(own, finished=True)
    comparison = plan.begin(0.0)
    assert comparison == Comparison("a", own, earlier)
    plan.done(comparison, now=0.0, took=1.0)
    assert plan.begin(0.1) is None
    assert plan.held == ()


def test_a_map_of_an_earlier_run_of_a_peer_does_not_replace_that_of_the_later() -> None:
    plan = ComparisonSchedule("a", PARAMETERS)
    for robot_map in (a_run("b", 1, "now"), a_run("b", 0, "before")):
        plan.peer_map(robot_map)
    assert plan.held == (MapVersion(robot="b", boot="now", version=1),)


def test_pairs_take_turns() -> None:
    plan = ComparisonSchedule("a", PARAMETERS)
    peers = [f"p{number}" for number in range(12)]
    duties = [peer for peer in peers if responsible("a", peer) == "a"]
    for peer in peers:
        plan.peer_here(peer, "x")
        plan.peer_map(a_map(peer, 1))
    compared = []
    for turn in range(2 * len(duties)):
        plan.own_map(a_map("a", turn + 1), finished=False)
        comparison = plan.begin(100.0 * turn)
        assert comparison is not None
        plan.done(comparison, 100.0 * turn, 1.0)
        compared.append(comparison.peer)
    assert sorted(compared) == sorted(2 * duties)


@dataclass
class Side:
    """One of two robots in a simulated exchange."""

    plan: ComparisonSchedule
    version: int = 0
    under_way: Comparison | None = None
    results: list[Comparison] = field(default_factory=list)


EVENTS = st.sampled_from(["a maps", "b maps", "a works", "b works", "time"])


@given(st.lists(EVENTS, max_size=60))
@settings(deadline=None)
def test_in_the_end_the_last_maps_were_compared_by_the_responsible_one_alone(
    events: list[str],
) -> None:
    sides = {robot: Side(ComparisonSchedule(robot, PARAMETERS)) for robot in "ab"}
    for robot, peer in ("ab", "ba"):
        sides[robot].plan.peer_here(peer, "x")
    now = 0.0
    ending = [*events, "a maps", "b maps", "end", *("a works", "b works", "time") * 4]
    for event in ending:
        robot = event[0]
        if event == "time":
            now += 3.0
        elif event == "end":
            for one, other in ("ab", "ba"):
                sides[one].plan.own_map(a_map(one, sides[one].version), finished=True)
                sides[other].plan.peer_finished(one, "x", sides[one].version)
        elif event.endswith("maps"):
            sides[robot].version += 1
            sides[robot].plan.own_map(a_map(robot, sides[robot].version), finished=False)
            sides["ba"["ab".index(robot)]].plan.peer_map(a_map(robot, sides[robot].version))
        else:
            work(sides[robot], now)
    assert not sides[SECOND].results
    last = sides[FIRST].results[-1]
    assert {m.robot: m.version for m in (last.reference, last.other)} == {
        robot: side.version for robot, side in sides.items()
    }


def work(side: Side, now: float) -> None:
    """Finish the comparison under way, or begin one."""
    if side.under_way is not None:
        side.plan.done(side.under_way, now, 1.0)
        side.results.append(side.under_way)
        side.under_way = None
    else:
        side.under_way = side.plan.begin(now)


def drive(plan: PublicationSchedule, start: float, end: float, component: int = 0) -> None:
    for x in np.linspace(start, end, 5):
        plan.moved(component, np.array([x, 0.0, 0.0]))


def test_a_finished_submap_is_published_at_once_and_growth_as_far_as_was_driven() -> None:
    plan = PublicationSchedule(AgentParameters())
    assert plan.due(0.0)
    plan.published(0.0)
    drive(plan, 0.0, 1.9)
    assert not plan.due(9.9)
    assert plan.due(10.0)
    drive(plan, 1.9, 2.1)
    assert plan.due(2.0)
    assert not plan.due(1.9)  # however fast it drives
    plan.hurry()
    assert plan.due(0.1)
    plan.published(0.1)
    assert not plan.due(9.0)


def test_growth_waits_until_the_way_has_paid_for_it() -> None:
    p = AgentParameters()
    plan = PublicationSchedule(p)
    plan.published(0.0)
    drive(plan, 0.0, 2.0)
    assert plan.due(2.0)
    plan.published(2.0, size=500)
    drive(plan, 2.0, 4.5)
    assert not plan.due(4.0)
    plan.hurry()  # what has settled does not wait
    assert plan.due(4.0)
    plan.published(4.0, size=100)
    drive(plan, 4.5, 28.0)
    assert plan.due(6.0)


def test_a_leap_into_another_component_is_no_way_driven() -> None:
    plan = PublicationSchedule(AgentParameters())
    plan.published(0.0)
    drive(plan, 0.0, 0.5)
    drive(plan, 100.0, 100.5, component=1)
    assert not plan.due(5.0)


def joined(*names: str) -> JointStatusMessage:
    """Return the status of a coordinator whose joint map has these components as one."""
    place = Place(frame=names[0], pose=(0.0, 0.0, 0.0))
    return coordinator_status(frames=dict.fromkeys(names, place))


def coordinator_status(**fields: object) -> JointStatusMessage:
    said = {"boot": "c", "stamp": 0.0, "series": "s", "version": 1, "pending": False}
    return JointStatusMessage.model_validate(said | fields)


def test_runs_that_are_over_are_compared_by_their_robot_until_they_are_joined() -> None:
    plan = ComparisonSchedule(SECOND, PARAMETERS)  # not the one that compares what is alive
    plan.earlier_map(a_run(SECOND, 0, "before"))
    plan.own_map(a_run(SECOND, 1, "now"), finished=True)
    plan.peer_here(FIRST, "x")
    plan.peer_map(a_run(FIRST, 0, "x"))
    pairs = set()
    while (comparison := plan.begin(1e9)) is not None:
        pairs.add(frozenset({comparison.reference.boot, comparison.other.boot}))
        plan.done(comparison, 1e9, 0.0)
    assert pairs == {frozenset({"before", "now"}), frozenset({"before", "x"})}
    plan.own_map(replace(a_run(SECOND, 1, "now"), version=2), finished=True)
    plan.coordinator(joined(f"{SECOND}/0", f"{SECOND}/1"))
    assert plan.idle


def test_what_a_coordinator_holds_of_a_pair_is_not_compared_again() -> None:
    plan = plan_of(FIRST, SECOND)
    states = [MapVersion(robot=robot, boot="x", version=1) for robot in ("a", "b")]
    plan.coordinator(coordinator_status(alignments=(tuple(states),)))
    assert plan.idle


def test_maps_of_robots_that_are_gone_are_asked_for_until_they_are_here() -> None:
    plan = ComparisonSchedule(SECOND, PARAMETERS)
    plan.own_map(a_run(SECOND, 0, "now"), finished=True)
    state = MapVersion(robot=FIRST, boot="x", version=1)
    for now in (0.0, GRACE):
        plan.coordinator(coordinator_status(maps=(state,)))
        assert plan.to_ask_for(now) == ([] if now < GRACE else [state])
    plan.peer_map(a_run(FIRST, 0, "x"))
    assert plan.to_ask_for(10 * GRACE) == []
    assert not plan.idle  # it is gone, so it is for us to compare
    plan.peer_here(FIRST, "x")
    plan.coordinator(coordinator_status(maps=(state,)))
    assert plan.idle


def test_of_two_with_one_id_the_one_of_the_smaller_boot_compares_them() -> None:
    plans = {boot: ComparisonSchedule("a", PARAMETERS) for boot in ("x", "y")}
    for own, other in ("xy", "yx"):
        plans[own].own_map(a_run("a", 0, own), finished=True)
        plans[own].peer_here("a", other)
        plans[own].peer_map(a_run("a", 0, other))
    assert plans["y"].idle
    comparison = plans["x"].begin(1e9)
    assert comparison is not None
    assert {comparison.reference.boot, comparison.other.boot} == {"x", "y"}


def test_what_a_robot_found_that_is_gone_is_told_in_our_name() -> None:
    first, second = plan_of(FIRST, SECOND), plan_of(SECOND, FIRST)
    comparison = first.begin(0.0)
    assert comparison is not None
    second.learned(found(comparison, FIRST))
    assert list(second.orphans) == []
    second.peer_gone(FIRST, "x")
    assert list(second.orphans) == [found(comparison, SECOND)]


def test_maps_whose_shapes_speak_of_one_place_are_compared_first() -> None:
    plan, likely, _ = plan_among_strangers()
    comparison = plan.begin(0.0)
    assert comparison is not None
    assert comparison.peer == likely


def test_maps_whose_shapes_say_nothing_are_compared_once_they_have_waited() -> None:
    plan, likely, unlikely = plan_among_strangers()
    waited = PARAMETERS.comparison_patience
    for turn in range(3):
        comparison = plan.begin(turn * 0.1)
        assert comparison is not None
        assert comparison.peer == likely
        plan.peer_map(seen_by(likely, part(BUILDING, 4.0, 16.0), version=2 + turn))
    later = plan.begin(waited)
    assert later is not None
    plan.done(later, waited, 0.1)
    after = plan.begin(waited)
    assert after is not None
    assert {later.peer, after.peer} == {likely, unlikely}


def test_in_a_large_team_maps_whose_shapes_say_nothing_are_not_compared() -> None:
    for strangers, compared in ((2, 2), (1, 1)):
        plan, likely, unlikely = plan_among_strangers(strangers)
        peers = []
        for turn in range(3):
            comparison = plan.begin(1e9)
            if comparison is not None:
                peers.append(comparison.peer)
                plan.done(comparison, 1e9, 0.1)
            assert plan.idle == (turn + 1 >= compared)
        assert peers == [likely, unlikely][:compared]


def seen_by(robot: str, lines: LineMap, version: int = 1) -> RobotMap:
    submap = Submap(0, 0, np.zeros(3), lines, Trajectory.empty())
    return RobotMap(robot, "x", version, (submap,))


def plan_among_strangers(strangers: int = 2) -> tuple[ComparisonSchedule, str, str]:
    """Return a plan, a peer that saw what this robot saw, and one that comes before it by name."""
    robot = "r"
    unlikely, likely = (n for n in PEERS if responsible(robot, n) == robot)
    plan = ComparisonSchedule(robot, PARAMETERS.model_copy(update={"strangers": strangers}))
    plan.own_map(seen_by(robot, part(BUILDING, 0.0, 14.0)), finished=False)
    for peer, lines in ((unlikely, ELSEWHERE), (likely, part(BUILDING, 4.0, 16.0))):
        plan.peer_here(peer, "x")
        plan.peer_map(seen_by(peer, lines))
    return plan, likely, unlikely


def test_who_follows_in_a_stored_map_compares_it_with_all_as_nobody_else_has_it() -> None:
    for peer in (FIRST, SECOND):
        robot = SECOND if peer == FIRST else FIRST
        plan = ComparisonSchedule(robot, PARAMETERS)
        plan.follow_in(a_map(robot, 0))
        plan.peer_here(peer, "x")
        plan.peer_map(a_map(peer, 1))
        assert plan.begin(0.0) is not None


def test_the_path_of_one_that_follows_in_a_stored_map_is_compared_by_nobody() -> None:
    driven = Trajectory(np.arange(3), np.zeros(3), np.zeros((3, 3)))
    path = Submap(1, 0, np.zeros(3), LineMap.empty(), driven)
    plan = plan_of(FIRST, SECOND)
    plan.peer_map(RobotMap(SECOND, "x", 7, (path,)))
    assert plan.begin(1e9) is None
    assert plan.idle
    # Who waits until all is compared waits for none of this.
    assert plan.published[SECOND] == Compared(own_version=1, peer_boot="x", peer_version=7)
