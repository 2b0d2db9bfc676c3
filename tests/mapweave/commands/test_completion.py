"""What a shell completes, and what each command's help shows."""

import argparse
import shlex
import subprocess
import sys
from importlib.metadata import entry_points
from pathlib import Path

import pytest

from mapweave.cli import COMMAND_GROUP, Command, parser_of
from mapweave.errors import MissingExtraError
from tests.mapweave.commands.test_commands import main_here, mapweave

COMMANDS = {point.name: point for point in entry_points(group=COMMAND_GROUP)}
SERVING = {"router", "server", "agent", "bridge", "completion"}  # they log, or make a script


@pytest.fixture(scope="module")
def script(tmp_path_factory: pytest.TempPathFactory) -> Path:
    done = mapweave("completion", "bash")
    assert (done.returncode, done.stderr) == (0, "")
    path = tmp_path_factory.mktemp("shell") / "mapweave.bash"
    path.write_text(done.stdout)
    return path


def completed(script: Path, *words: str) -> list[str]:
    """Return what a real bash offers for the last of `words`."""
    line = " ".join(shlex.quote(word) for word in ("mapweave", *words))
    program = (
        f"source {shlex.quote(str(script))}; COMP_WORDS=({line}); COMP_CWORD={len(words)};"
        " _shtab_mapweave; printf '%s\\n' \"${COMPREPLY[@]}\""
    )
    done = subprocess.run(
        ["bash", "--norc", "-c", program],
        capture_output=True,
        text=True,
        check=True,
        timeout=60,
        cwd=script.parent,
    )
    return done.stdout.split()


def test_bash_completes_commands_options_and_files(script: Path) -> None:
    (script.parent / "robot.log").touch()
    assert set(completed(script, "")) >= {"map", "fuse", "agent", "completion"}
    assert completed(script, "exp") == ["export"]
    assert "--localize" in completed(script, "map", "--l")
    assert completed(script, "map", "robot") == ["robot.log"]
    assert completed(script, "map", "--continue", "robot") == ["robot.log"]


@pytest.mark.parametrize("shell", ["zsh", "tcsh"])
def test_other_shells_are_told_of_every_command(shell: str) -> None:
    done = main_here("completion", shell)
    assert done.returncode == 0
    assert all(name in done.stdout for name in COMMANDS)


def test_a_shell_that_is_not_known_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main_here("completion", "fish")
    assert ended.value.code == 2
    assert capsys.readouterr().out == ""


def test_without_shtab_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "shtab", None)
    command: Command = COMMANDS["completion"].load()
    with pytest.raises(MissingExtraError, match=r"mapweave\[completion\]"):
        command.run(argparse.Namespace(shell="bash"))


@pytest.mark.parametrize("name", sorted(COMMANDS.keys() - SERVING))
def test_what_a_command_tells_can_be_had_as_json(name: str) -> None:
    assert "--json" in parser_of(name, COMMANDS[name].load()).format_usage()


@pytest.mark.parametrize("name", sorted(COMMANDS))
def test_the_help_of_a_command_ends_with_an_example_that_it_takes(name: str) -> None:
    command: Command = COMMANDS[name].load()
    parser = parser_of(name, command)
    assert command.example
    assert (
        "example: mapweave"
        in parser.format_help().rstrip().splitlines()[-2:][0]
        + (parser.format_help().rstrip().splitlines()[-1])
    )
    parser.parse_args(shlex.split(command.example))
