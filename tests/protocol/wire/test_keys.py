import pytest
import zenoh

from mapweave.errors import InvalidIdError
from mapweave_protocol.errors import ForeignKeyError
from mapweave_protocol.wire import keys
from mapweave_protocol.wire.keys import KeyFormat
from mapweave_protocol.wire.pairs import ordered, responsible

FORMATS = [
    keys.MAP, keys.STATUS, keys.ALIGNMENT, keys.AGENT_QUERY, keys.JOINT_MAP, keys.JOINT_STATUS,
    keys.JOINT_QUERY, keys.LIVE, keys.COORDINATOR_LIVE, keys.MARK, keys.ORDER,
]  # fmt: skip
EXAMPLE = {"team": "rescue", "robot": "r1", "reference": "r1", "other": "r2", "boot": "0af3"}
EXAMPLE |= {"name": "anna", "order": "pin"}


def parts_of(keys_of: KeyFormat) -> dict[str, str]:
    return {name: EXAMPLE[name] for name in keys_of.names}


@pytest.mark.parametrize("keys_of", FORMATS)
def test_parsing_undoes_building(keys_of: KeyFormat) -> None:
    assert keys_of.parse(keys_of.build(**parts_of(keys_of))) == parts_of(keys_of)


def test_keys_are_those_of_the_design() -> None:
    assert keys.ALIGNMENT.build(**parts_of(keys.ALIGNMENT)) == (
        "mapweave/v2/rescue/agent/r1/alignment/r1/r2"
    )
    assert (
        keys.LIVE.build(team="rescue", robot="r1", boot="7") == "mapweave/v2/rescue/live/agent/r1/7"
    )


@pytest.mark.parametrize("keys_of", FORMATS)
def test_no_part_of_a_key_begins_with_an_at_sign(keys_of: KeyFormat) -> None:
    # Zenoh would not bring what was published during an outage.
    assert not any(part.startswith("@") for part in keys_of.build(**parts_of(keys_of)).split("/"))


@pytest.mark.parametrize("keys_of", FORMATS)
def test_everything_of_a_team_is_published_below_its_key(keys_of: KeyFormat) -> None:
    key = zenoh.KeyExpr(keys_of.build(**parts_of(keys_of)))
    assert zenoh.KeyExpr(keys.everything("rescue")).includes(key)
    assert not zenoh.KeyExpr(keys.everything("others")).intersects(key)


@pytest.mark.parametrize("keys_of", FORMATS)
def test_a_pattern_matches_its_team_only(keys_of: KeyFormat) -> None:
    pattern = zenoh.KeyExpr(keys_of.pattern(team="rescue"))
    others = parts_of(keys_of) | {"team": "others"}
    assert pattern.includes(zenoh.KeyExpr(keys_of.build(**parts_of(keys_of))))
    assert not pattern.intersects(zenoh.KeyExpr(keys_of.build(**others)))


@pytest.mark.parametrize("one", FORMATS)
def test_a_key_is_of_one_format_only(one: KeyFormat) -> None:
    key = one.build(**parts_of(one))
    assert [other for other in FORMATS if other.matches(key)] == [one]


@pytest.mark.parametrize("name", ["", "*", "a/b", "A", "a b", "a\n", "x" * 33, "@v1", "a*", "ä"])
def test_a_name_that_is_no_id_makes_no_key(name: str) -> None:
    with pytest.raises(InvalidIdError):
        keys.MAP.build(team="rescue", robot=name)
    with pytest.raises(InvalidIdError):
        keys.MAP.pattern(team=name)


@pytest.mark.parametrize(
    "key",
    [
        "",
        "mapweave/v2/t/agent/r/map/",
        "mapweave/v2/t/agent/r/more/map",
        "mapweave/@v1/t/agent/r/map",
        "x/mapweave",
    ],
)
def test_a_foreign_key_is_refused(key: str) -> None:
    assert not keys.MAP.matches(key)
    with pytest.raises(ForeignKeyError):
        keys.MAP.parse(key)


def test_a_key_with_a_part_that_is_no_id_is_refused() -> None:
    with pytest.raises(InvalidIdError):
        keys.MAP.parse("mapweave/v2/t/agent/R 1/map")


def test_both_of_a_pair_name_the_same_one_responsible_and_order() -> None:
    robots = [f"r{number}" for number in range(12)]
    for a in robots:
        for b in robots:
            assert responsible(a, b) == responsible(b, a)
            assert responsible(a, b) in (a, b)
            assert ordered(a, b) == ordered(b, a)


def test_the_comparisons_are_spread_over_the_team() -> None:
    robots = [f"r{number}" for number in range(20)]
    duties = {r: sum(responsible(r, peer) == r for peer in robots if peer != r) for r in robots}
    assert max(duties.values()) < 19
    assert min(duties.values()) > 0
