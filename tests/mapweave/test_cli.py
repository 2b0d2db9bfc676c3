"""The program finds its subcommands by entry point, and turns errors into a line and a status."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from importlib.metadata import entry_points, version
from pathlib import Path

import pytest

from mapweave import cli
from mapweave.cli import main
from mapweave.errors import FileError, InvalidIdError, MissingExtraError

MAPWEAVE = Path(sys.executable).with_name("mapweave")


@pytest.fixture
def offer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[str], None]:
    """Return what installs a distribution that offers ``mapweave try``, which runs a statement."""

    def install(statement: str) -> None:
        (tmp_path / "tried.py").write_text(
            "from mapweave.cli import Command\n"
            "from mapweave.errors import *\n"
            "def run(options):\n"
            f"    {statement}\n"
            "command = Command('Try it.', lambda parser: None, run)\n"
        )
        facts = tmp_path / "tried-1.0.dist-info"
        facts.mkdir()
        (facts / "METADATA").write_text("Metadata-Version: 2.1\nName: tried\nVersion: 1.0\n")
        (facts / "entry_points.txt").write_text("[mapweave.commands]\ntry = tried:command\n")
        monkeypatch.syspath_prepend(tmp_path)
        monkeypatch.delitem(sys.modules, "tried", raising=False)

    return install


def test_every_package_contributes_its_commands() -> None:
    names = {point.name for point in entry_points(group=cli.COMMAND_GROUP)}
    assert {"map", "fuse", "export", "watch", "agent", "server", "router", "team"} <= names


def test_help_lists_every_command_with_its_summary(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--help"]) == 0
    said = capsys.readouterr()
    for point in entry_points(group=cli.COMMAND_GROUP):
        assert re.search(rf"  {point.name} +{re.escape(point.load().summary)}\n", said.out)
    assert said.err == ""


def test_help_imports_no_command_and_nothing_that_is_slow_to_load() -> None:
    code = "import sys\nfrom mapweave.cli import main\nmain(['--help'])\nprint(*sys.modules)"
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = set(told.stdout.split())
    assert loaded.isdisjoint({"numpy", "scipy", "gtsam", "zenoh", "pydantic", "rich"})
    assert loaded.isdisjoint(point.module for point in entry_points(group=cli.COMMAND_GROUP))


@pytest.mark.parametrize(("told", "taken"), [(None, "1"), ("3", "3")])
def test_matrix_products_take_one_thread_unless_the_environment_says_how_many(
    told: str | None, taken: str
) -> None:
    code = (
        "import os, sys\n"
        "from mapweave import __main__, cli\n"
        "cli.main = lambda: print('numpy' in sys.modules, os.environ['OPENBLAS_NUM_THREADS'])\n"
        "__main__.main()\n"
    )
    environment = {k: v for k, v in os.environ.items() if k != "OPENBLAS_NUM_THREADS"}
    if told is not None:
        environment["OPENBLAS_NUM_THREADS"] = told
    said = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True
    )
    assert said.stdout.split() == ["False", taken]  # too late once numpy is loaded


@pytest.mark.parametrize("command", ["Command('Try' + ' it.', None, run)", "make()"])
def test_a_summary_that_the_source_does_not_state_is_looked_up(
    command: str,
    offer: Callable[[str], None],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    offer("return 0")
    tried = tmp_path / "tried.py"
    stated = "command = Command('Try it.', lambda parser: None, run)"
    source = tried.read_text().replace(stated, f"make = lambda: {stated[10:]}\ncommand = {command}")
    tried.write_text(source)
    assert main(["--help"]) == 0
    assert re.search(r"  try +Try it\.\n", capsys.readouterr().out)
    assert "tried" in sys.modules


def test_summaries_in_the_overview_stand_below_each_other(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["--help"]) == 0
    lines = [line for line in capsys.readouterr().out.splitlines() if line.startswith("  ")]
    starts = {found.end() for line in lines if (found := re.match(r"  [a-z-]+ +", line))}
    assert len(lines) > 10
    assert len(starts) == 1


def test_without_a_command_the_overview_goes_to_standard_error(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main([]) == cli.EXIT_USAGE
    said = capsys.readouterr()
    assert said.out == "" and said.err.startswith("usage: mapweave COMMAND")


def test_the_version_is_that_of_the_distribution(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--version"]) == 0
    assert capsys.readouterr().out == f"mapweave {version('mapweave')}\n"


def test_an_unknown_command_is_wrong_usage_and_the_known_ones_are_named(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["frobnicate"]) == cli.EXIT_USAGE
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    known = ", ".join(sorted(point.name for point in entry_points(group=cli.COMMAND_GROUP)))
    assert "'frobnicate'" in said and f"there are {known}\n" in said


@pytest.mark.parametrize(
    "words",
    [
        ["map"],
        ["fuse"],
        ["export", "one.json"],
        ["map", "log", "--scans", "9:3"],
        ["map", "log", "--scans", "3"],
        ["map", "log", "--scans=-2:3"],
        ["map", "log", "--odometry", "x"],
        ["map", "log", "--frobnicate"],
    ],
    ids=" ".join,
)
def test_wrong_usage_exits_with_2(words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as caught:
        main(words)
    assert caught.value.code == cli.EXIT_USAGE
    assert "usage: mapweave" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("statement", "line"),
    [
        ("raise FileError('a.json', 'is empty')", "mapweave: a.json: is empty\n"),
        (
            "raise MissingExtraError('A picture', 'plot')",
            "mapweave: A picture needs an optional package: pip install 'mapweave[plot]'\n",
        ),
        ("raise MapweaveError('no')", "mapweave: no\n"),
    ],
)
def test_an_error_is_one_line_and_exit_status_1(
    statement: str,
    line: str,
    offer: Callable[[str], None],
    capsys: pytest.CaptureFixture[str],
) -> None:
    offer(statement)
    assert main(["try"]) == cli.EXIT_FAILED
    assert capsys.readouterr() == ("", line)


def test_an_interruption_is_said_and_has_the_shells_status(
    offer: Callable[[str], None], capsys: pytest.CaptureFixture[str]
) -> None:
    offer("raise KeyboardInterrupt")
    assert main(["try"]) == cli.EXIT_INTERRUPTED == 130
    assert capsys.readouterr().err == "mapweave: interrupted\n"


@pytest.mark.parametrize("words", [["--help"], ["--version"], ["map", "--help"]])
def test_a_reader_that_has_gone_is_no_traceback(words: list[str]) -> None:
    """As with ``mapweave --help | head -1``."""
    reading, writing = os.pipe()
    os.close(reading)
    program = [sys.executable, "-m", "mapweave", *words]
    done = subprocess.run(program, stdout=writing, stderr=subprocess.PIPE, text=True, check=False)
    os.close(writing)
    assert done.stderr == ""


def test_what_a_terminal_has_no_letters_for_ends_nothing() -> None:
    environment = os.environ | {"PYTHONIOENCODING": "ascii"}
    done = subprocess.run(
        [MAPWEAVE, "--help"], env=environment, capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("usage: mapweave COMMAND ?\n")


@pytest.mark.parametrize(
    ("words", "status"),
    [
        ("map scans --output map.json >&-", 0),
        ("map scans --output map.json 2>&-", 0),
        ("map scans --output map.json <&- >&- 2>&-", 0),
        ("map - --output map.json <&-", 1),
    ],
)
def test_streams_that_are_closed_are_empty_ones(words: str, status: int, tmp_path: Path) -> None:
    sweep = {"angle_min": -1.5, "angle_increment": 0.01, "ranges": [2.0] * 300}
    (tmp_path / "scans").write_text(json.dumps(sweep))
    line = f"{MAPWEAVE} {words}"
    done = subprocess.run(
        ["sh", "-c", line], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert done.returncode == status
    assert (tmp_path / "map.json").exists() == (status == 0)
    assert "Traceback" not in done.stderr
    if status:
        assert done.stderr.startswith("mapweave: standard input: is empty")


def test_in_a_folder_that_is_gone_one_line_says_so(tmp_path: Path) -> None:
    folder = tmp_path / "gone"
    folder.mkdir()
    line = f"cd {folder}; rmdir {folder}; {MAPWEAVE} map ../scans"
    done = subprocess.run(["sh", "-c", line], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert done.stderr == (
        "mapweave: the folder this runs in is gone; change to one that is there\n"
    )


def test_a_defect_is_not_hidden(offer: Callable[[str], None]) -> None:
    """Only errors raised on purpose become a line; a bug keeps its traceback."""
    offer("return 1 // 0")
    with pytest.raises(ZeroDivisionError):
        main(["try"])


def test_the_status_a_command_returns_is_the_programs(offer: Callable[[str], None]) -> None:
    offer("return 3")
    assert main(["try"]) == 3


@pytest.mark.parametrize(
    "words",
    [
        ["mark", "r1", "victim", "--at", "-3.5,1"],
        ["mark", "r1", "victim", "--at=-3.5,-1"],
        ["pin", "r1/0", "r2/0", "--transform", "-3,0.5,-90", "--reason", "seen"],
    ],
)
def test_a_place_that_begins_with_a_minus_is_no_option(
    words: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main([*words, "--connect", "nowhere"]) == cli.EXIT_FAILED
    assert "endpoint nowhere: expected" in capsys.readouterr().err


def test_errors_carry_what_they_are_about() -> None:
    error = FileError("a/b.json", "is empty")
    assert (error.path, error.problem) == (Path("a/b.json"), "is empty")
    assert InvalidIdError("robot", "A").name == "A"
    assert MissingExtraError("A picture", "plot").extra == "plot"


def test_an_output_without_room_is_told_in_one_line() -> None:
    if not Path("/dev/full").exists():
        pytest.skip("no device that is always full")
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(
            [MAPWEAVE, "config"], stdout=full, stderr=subprocess.PIPE, text=True, check=False
        )
    assert done.returncode == cli.EXIT_FAILED
    assert done.stderr == "mapweave: cannot write (No space left on device)\n"


EARLY = """
import sys
from mapweave import __main__ as program
print("heard from here on", file=sys.stderr, flush=True)
sys.argv[:] = ["mapweave", "server", "--connect", "tcp/127.0.0.1:9", "--store", sys.argv[1]]
sys.exit(program.main())
"""


@pytest.mark.parametrize("seconds", [0.0, 0.02, 0.1, 0.3, 0.6, 1.2])
def test_ctrl_c_however_early_leaves_no_traceback(seconds: float, tmp_path: Path) -> None:
    process = subprocess.Popen(
        [sys.executable, "-c", EARLY, tmp_path / "store"], stderr=subprocess.PIPE, text=True
    )
    assert process.stderr is not None
    assert process.stderr.readline() == "heard from here on\n"
    time.sleep(seconds)
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=60.0)
    assert "Traceback" not in said
    assert process.returncode in (cli.EXIT_INTERRUPTED, -signal.SIGINT)


LOADED = """
import os, signal, time
try:
    os.kill(os.getpid(), signal.SIGINT)
    time.sleep(60)
except KeyboardInterrupt as error:
    raise ValueError("a schema cannot be built") from error
"""


def test_ctrl_c_while_a_module_is_loaded_that_makes_another_error_of_it_is_an_interruption(
    offer: Callable[[str], None], tmp_path: Path
) -> None:
    offer("pass")
    tried = tmp_path / "tried.py"
    tried.write_text(LOADED + tried.read_text())
    done = subprocess.run(
        [MAPWEAVE, "try"],
        env={**os.environ, "PYTHONPATH": str(tmp_path)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stderr) == (cli.EXIT_INTERRUPTED, "mapweave: interrupted\n")
