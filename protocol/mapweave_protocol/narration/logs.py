"""What a program logs: when, how serious, of which robot; as text or as lines of JSON."""

import argparse
import json
import logging
import sys
from datetime import UTC, datetime

LEVELS = ("debug", "info", "warning", "error")
FORMATS = ("text", "json")


def add_log_arguments(parser: argparse.ArgumentParser) -> None:
    """Add ``--log-format`` and ``--log-level``; `begin_log` reads them."""
    parser.add_argument(
        "--log-format",
        choices=FORMATS,
        default="text",
        help="lines for a person (the default), or a JSON object a line",
    )
    parser.add_argument(
        "--log-level",
        choices=LEVELS,
        default="info",
        help="the least serious that is told (default info)",
    )


def begin_log(options: argparse.Namespace, who: str) -> None:
    """Log to standard error as `options` say.

    Parameters
    ----------
    who
        A robot's id, or ``coordinator``: of whom the lines are.
    """
    handler = logging.StreamHandler(sys.stderr)
    as_json = options.log_format == "json"
    handler.setFormatter(JsonFormatter(who) if as_json else TextFormatter(who))
    logging.basicConfig(level=options.log_level.upper(), handlers=[handler], force=True)


def _time(record: logging.LogRecord) -> datetime:
    return datetime.fromtimestamp(record.created, UTC)


class TextFormatter(logging.Formatter):
    """Lines such as ``2026-11-29 09:17:02Z WARNING r1 map of r2: refused, …``."""

    def __init__(self, who: str) -> None:
        super().__init__()
        self._who = who

    def formatMessage(self, record: logging.LogRecord) -> str:  # noqa: N802 - the base's name
        """Return the line; a trace comes after it."""
        when = f"{_time(record):%Y-%m-%d %H:%M:%S}Z"
        return f"{when} {record.levelname:<7} {self._who} {record.message}"


class JsonFormatter(logging.Formatter):
    """An object a line: ``time, level, who, logger, message``, and ``trace`` of a fault."""

    def __init__(self, who: str) -> None:
        super().__init__()
        self._who = who

    def format(self, record: logging.LogRecord) -> str:
        """Return the line."""
        fields = {
            "time": _time(record).isoformat(timespec="milliseconds"),
            "level": record.levelname.lower(),
            "who": self._who,
            "logger": record.name,
            "message": record.getMessage(),
        }
        if record.exc_info:
            fields["trace"] = self.formatException(record.exc_info)
        return json.dumps(fields)
