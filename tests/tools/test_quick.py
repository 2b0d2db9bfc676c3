"""Which tests ``make quick`` runs."""

import time
from pathlib import Path

import pytest

from tools.deadline import TIME, Deadline
from tools.durations import REST, summed
from tools.imports import distances, distances_of_tests, imported_names, module_name
from tools.quick import choose

ROOT = Path(__file__).parents[2]
ROOTS = [".", "agent"]
REPORT = """<testsuites><testsuite><testcase classname="tests.a.test_b" name="test_c[1]" time="2"/>
<testcase classname="tests.a.test_b" name="test_c[2]" time="3"/>
<testcase classname="tests.a.test_b" name="test_d" time="0.2"/></testsuite></testsuites>"""


@pytest.mark.parametrize(
    ("file", "name"),
    [
        ("mapweave/geometry/se2.py", "mapweave.geometry.se2"),
        ("agent/mapweave_agent/agent.py", "mapweave_agent.agent"),
        ("mapweave/__init__.py", "mapweave"),
    ],
)
def test_a_file_is_imported_by_its_path_below_the_nearest_root(file: str, name: str) -> None:
    assert module_name(file, ROOTS) == name


def test_a_name_taken_from_a_module_may_be_a_module_itself() -> None:
    source = "import a.b\nfrom c import d\ndef f():\n    from . import g\n"
    assert set(imported_names(source, "p.q")) == {"a.b", "c", "c.d", "p.q", "p.q.g"}


def test_distance_is_the_least_number_of_imports() -> None:
    graph = {"test": {"far", "near"}, "far": {"near"}, "near": {"changed"}, "changed": (), "x": ()}
    assert distances(graph, ["changed"]) == {"changed": 0, "near": 1, "far": 2, "test": 2}


def files() -> list[str]:
    found = [
        *ROOT.glob("mapweave/**/*.py"),
        *ROOT.glob("agent/**/*.py"),
        *ROOT.glob("tests/**/*.py"),
    ]
    return [str(file.relative_to(ROOT)) for file in found]


@pytest.mark.parametrize(
    ("changed", "test"),
    [
        ("mapweave/geometry/se2.py", "tests/mapweave/geometry/test_se2.py"),
        ("agent/mapweave_agent/agent.py", "tests/agent/test_agent.py"),
        ("mapweave/commands/map.py", "tests/mapweave/commands/test_commands.py"),
        ("README.md", "tests/test_documents.py"),
        ("tests/agent/conftest.py", "tests/agent/test_agent.py"),
    ],
)
def test_tests_of_a_changed_file_are_at_one(changed: str, test: str) -> None:
    assert distances_of_tests(ROOT, files(), [changed])[test] == 1


def test_a_changed_test_is_nearest_to_itself() -> None:
    changed = "tests/mapweave/geometry/test_se2.py"
    assert distances_of_tests(ROOT, files(), [changed])[changed] == 0


def test_near_tests_come_first_and_long_ones_are_left_out_when_time_is_short() -> None:
    durations = {
        "far": {REST: 1.0, "test_short": 2.0},
        "near": {REST: 3.0, "test_long": 9.0, "test_short": 1.0},
        "slow": {REST: 7.0},
    }
    choice = choose({"far": 2, "near": 1, "slow": 2}, durations, budget=8.0)
    assert choice.files == ["near", "far"]
    assert choice.left_out == ["near::test_long"]
    assert choice.further == 1


def test_tests_that_were_never_timed_are_run() -> None:
    assert choose({"new": 1}, {}, budget=1.0).files == ["new"]


def test_the_cases_of_a_test_are_timed_together_and_short_tests_as_one() -> None:
    assert summed(REPORT) == {"tests/a/test_b.py": {REST: 0.2, "test_c": 5.0}}


def test_when_the_time_is_up_what_has_not_begun_is_skipped(monkeypatch: pytest.MonkeyPatch) -> None:
    clock, deadline = iter([100.0, 100.0, 100.0 + TIME, 100.1 + TIME]), Deadline()
    monkeypatch.setattr(time, "monotonic", lambda: next(clock))
    deadline.pytest_runtest_setup()
    deadline.pytest_runtest_setup()
    with pytest.raises(pytest.skip.Exception):
        deadline.pytest_runtest_setup()
