"""What the commands tell of a store, also while a coordinator has it open."""

import json
import re
import resource
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from mapweave.cli import main
from mapweave.io.map_files import read_joint
from mapweave.maps import Alignment, Decision, JointComponent, JointMap, LineMap
from mapweave.reasons import Reason
from mapweave_fusion_server.store import Store
from mapweave_protocol.wire.codec import encode
from mapweave_protocol.wire.messages import JointMapMessage

Run = Callable[..., list[str]]


def _component(*robots: str, walls: int = 1) -> JointComponent:
    segments = np.array([[0.0, k, 4.0, k] for k in range(walls)])
    lines = LineMap(segments, np.arange(walls), np.full(walls, 9), ())
    poses = {robot: np.array([float(k), 0.0, 0.0]) for k, robot in enumerate(robots)}
    return JointComponent(poses, 0.9, lines, np.full(walls, 0.8))


def _alignment(decision: Decision) -> Alignment:
    cause = Reason.words("40 m of wall in common")
    return Alignment("a/0", "b/0", np.array([1.0, 0.0, 0.0]), decision, 0.9, cause)


JOINTS = (
    JointMap(1, (_component("a/0"), _component("b/0")), ()),
    JointMap(2, (_component("a/0"), _component("b/0")), (_alignment("refused"),)),
    JointMap(3, (_component("a/0", "b/0", walls=3), _component("c/0")), (_alignment("accepted"),)),
)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "store.sqlite"


@pytest.fixture(params=["closed", "in use"])
def run(
    path: Path, capsys: pytest.CaptureFixture[str], request: pytest.FixtureRequest
) -> Iterator[Run]:
    """Run a command on a store of three versions, and return the lines it prints."""

    def run(*words: str, status: int = 0) -> list[str]:
        assert main([*words, "--store", str(path)]) == status
        said = capsys.readouterr()
        return [*said.out.splitlines(), *said.err.splitlines()]

    with Store(path, "rescue") as store:
        for joint in JOINTS:
            message = encode(JointMapMessage.pack(joint, store.series))
            store.add_version(joint.version, 86400.0 * joint.version, message)
        if request.param == "in use":
            yield run
            return
    yield run


def test_history_lists_versions_with_when_and_who(run: Run) -> None:
    lines = run("history")
    assert [line.split()[:3] for line in lines] == [
        ["1", "1970-01-02", "00:00:00"],
        ["2", "1970-01-03", "00:00:00"],
        ["3", "1970-01-04", "00:00:00"],
    ]
    assert lines[2].endswith("a/0 + b/0 (90%), alone: c/0")
    assert [line.split()[0] for line in run("history", "--limit", "1")] == ["3"]


@pytest.mark.parametrize("time", ["'abc'", "9e999", "x'00ff'"])
def test_a_time_that_is_damaged_is_unknown_and_the_rest_is_listed(
    time: str, path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with Store(path, "rescue") as store:
        for joint in JOINTS:
            message = encode(JointMapMessage.pack(joint, store.series))
            store.add_version(joint.version, 86400.0 * joint.version, message)
        store._database.rows(f"UPDATE version SET created = {time} WHERE number = 2")
    assert main(["history", "--store", str(path)]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[1] for line in lines] == ["1970-01-02", "unknown", "1970-01-04"]
    assert main(["history", "--store", str(path), "--json"]) == 0
    told = [json.loads(line)["created"] for line in capsys.readouterr().out.splitlines()]
    assert told == [86400.0, None, 3 * 86400.0]


def test_history_is_there_for_programs(run: Run) -> None:
    last = json.loads(run("history", "--json")[-1])
    assert last["version"] == 3
    assert last["created"] == 3 * 86400.0
    assert last["components"] == [["a/0", "b/0"], ["c/0"]]


def test_show_tells_a_version_and_writes_it(run: Run, tmp_path: Path) -> None:
    told = run("show", "2", "--output", str(tmp_path / "joint.json"))
    assert told[0] == "version 2: alone: a/0, b/0"
    assert told[1].startswith("a/0 and b/0: refused: 40 m of wall in common")
    assert read_joint(tmp_path / "joint.json").version == 2
    assert run("show", "latest")[0].startswith("version 3: a/0 + b/0")


def test_what_is_told_of_a_store_is_there_for_programs(run: Run, path: Path) -> None:
    def told(*words: str) -> dict[str, object]:
        [line] = run(*words, "--json")
        content = json.loads(line)
        assert isinstance(content, dict)
        return content

    shown = told("show", "2")
    assert (shown["version"], shown["components"]) == (2, [["a/0"], ["b/0"]])
    assert [a["decision"] for a in shown["alignments"]] == ["refused"]  # type: ignore[attr-defined]
    changed = told("diff", "2", "3")
    assert changed["new"] == ["c/0"]
    assert changed["judged"] == [["a/0", "b/0", "refused", "accepted"]]
    assert changed["wall"] == [8.0, 16.0]
    assert told("check") == {"store": str(path), "versions": [1, 3], "problems": []}
    copy = str(path.with_name("copy.sqlite"))
    assert told("backup", copy) == {"versions": [1, 3], "copy": copy}


@pytest.mark.parametrize("words", [["show", "latest"], ["history"], ["diff", "1", "2"], ["check"]])
def test_the_store_of_another_team_is_not_taken_for_that_of_the_team(
    run: Run, path: Path, words: list[str]
) -> None:
    another = f"mapweave: {path}: the store of team 'rescue', expected team 'other'"
    assert run(*words, "--team", "other", status=1) == [another]
    assert run(*words, "--team", "rescue") == run(*words)


def test_diff_tells_who_joined_what_was_decided_and_how_much_wall(run: Run) -> None:
    told = run("diff", "2", "3")
    assert "c/0 is new" in told
    assert "a/0 and b/0: refused before, accepted after" in told
    assert told[-1] == "walls: 8 m before, 16 m after"
    back = run("diff", "3", "1")
    assert "c/0 is gone" in back
    assert "a/0 and b/0: accepted before, no longer compared after" in back


def test_a_backup_is_a_store_of_the_same_versions(run: Run, tmp_path: Path) -> None:
    assert run("backup", str(tmp_path / "copy.sqlite")) == [
        f"versions 1 to 3, in {tmp_path / 'copy.sqlite'}"
    ]
    with Store(tmp_path / "copy.sqlite", "rescue") as copy:
        assert copy.latest_version == 3


def test_a_backup_takes_the_place_of_an_earlier_one_and_of_nothing_else(
    run: Run, tmp_path: Path
) -> None:
    copy, other, log = (tmp_path / name for name in ("copy.sqlite", "other.sqlite", "r1.log"))
    for _ in range(2):
        run("backup", str(copy))
    with Store(other, "rescue"):
        pass
    log.write_text("FLASER")
    for path in (other, log):
        before = path.read_bytes()
        [line] = run("backup", str(path), status=1)
        assert line == (
            f"mapweave: {path}: is no backup of a store, and would be overwritten;"
            " expected another name"
        )
        assert path.read_bytes() == before


def test_a_backup_that_finds_no_room_names_the_copy(run: Run, tmp_path: Path) -> None:
    limit = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (36864, limit[1]))
    try:
        [line] = run("backup", str(tmp_path / "copy.sqlite"), status=1)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limit)
    assert line.startswith(f"mapweave: {tmp_path / 'copy.sqlite'}: cannot be written: ")
    assert [path.name for path in tmp_path.glob("copy*")] == []


def test_a_version_that_is_not_there_is_told_in_one_line(run: Run, path: Path) -> None:
    [line] = run("show", "4", status=1)
    assert line == f"mapweave: {path}: no version 4 of the joint map; there are 1 to 3"


def test_check_finds_a_whole_store_whole(run: Run, path: Path) -> None:
    assert run("check") == [f"{path}: whole, versions 1 to 3"]


def test_check_names_each_row_that_is_damaged(
    path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with Store(path, "rescue") as store:
        good = encode(JointMapMessage.pack(JOINTS[0], store.series))
        store.add_version(1, 0.0, good)
        store.add_version(2, 0.0, b"no message at all")
    assert main(["check", "--store", str(path)]) == 1
    assert re.search("row 2 of version: message .*", capsys.readouterr().out)
    path.write_bytes(path.read_bytes().replace(good[-20:], bytes(20)))
    assert main(["check", "--store", str(path)]) == 1
    assert "row 1 of version is damaged" in capsys.readouterr().out


@pytest.mark.parametrize("number", ["0", "-1", "two", "1.5", "9" * 30])
def test_a_number_that_is_none_is_wrong_usage(
    number: str, path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["show", "--store", str(path), "--", number])
    assert ended.value.code == 2
    assert "expected the number of a version" in capsys.readouterr().err


def test_a_store_that_is_missing_is_not_made(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    missing = tmp_path / "nowhere.sqlite"
    assert main(["history", "--store", str(missing)]) == 1
    assert str(missing) in capsys.readouterr().err
    assert not missing.exists()
