"""Logs say when, how serious and of whom; for programs as an object a line."""

import argparse
import json
import logging
from collections.abc import Iterator

import pytest

from mapweave_protocol.narration.logs import add_log_arguments, begin_log


@pytest.fixture(autouse=True)
def root() -> Iterator[None]:
    """Put the handlers of the root back."""
    before, level = logging.root.handlers[:], logging.root.level
    yield
    logging.root.handlers[:] = before
    logging.root.setLevel(level)


def _begin(*words: str) -> None:
    parser = argparse.ArgumentParser()
    add_log_arguments(parser)
    begin_log(parser.parse_args(words), "r1")


def test_a_line_has_date_level_and_robot(capsys: pytest.CaptureFixture[str]) -> None:
    _begin()
    logging.getLogger("some.module").warning("%d messages refused", 3)
    date, time, level, who, *message = capsys.readouterr().err.split()
    assert len(date.split("-")) == 3 and time.endswith("Z")
    assert (level, who, " ".join(message)) == ("WARNING", "r1", "3 messages refused")


def test_an_object_a_line_says_the_same_and_a_fault_stays_on_its_line(
    capsys: pytest.CaptureFixture[str],
) -> None:
    _begin("--log-format", "json")
    try:
        int("a fault")
    except ValueError:
        logging.getLogger("some.module").exception("it\nfailed")
    [line] = capsys.readouterr().err.splitlines()
    said = json.loads(line)
    assert (said["level"], said["who"], said["logger"]) == ("error", "r1", "some.module")
    assert said["message"] == "it\nfailed"
    assert "ValueError: invalid literal" in said["trace"]
    assert said["time"].endswith("+00:00")


@pytest.mark.parametrize(("level", "told"), [("debug", 4), ("info", 3), ("error", 1)])
def test_what_is_less_serious_than_the_level_is_not_told(
    level: str, told: int, capsys: pytest.CaptureFixture[str]
) -> None:
    _begin("--log-level", level)
    log = logging.getLogger("some.module")
    for tell in (log.debug, log.info, log.warning, log.error):
        tell("something")
    assert len(capsys.readouterr().err.splitlines()) == told
