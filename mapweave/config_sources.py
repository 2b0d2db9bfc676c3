"""Where a configuration comes from: a file in TOML, and variables of the environment."""

import json
import reprlib
import tomllib
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

from mapweave.errors import ConfigError

_PREFIX = "MAPWEAVE"


class Given(NamedTuple):
    """What a file or a variable says, checked later; and which of them."""

    value: object
    origin: str


def in_file(path: Path, sections: Collection[str]) -> Iterator[tuple[str, Given]]:
    """Yield what the file at `path` says of `sections`, by names such as ``sensor.rate``.

    Raises
    ------
    ConfigError
        If it cannot be read, is not TOML, or has another section.
    """
    origin, known = str(path), ", ".join(sections)
    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ConfigError(origin, "", f"cannot be read ({error.strerror})") from error
    except (ValueError, RecursionError) as error:  # not UTF-8, or not TOML, or nested too deeply
        raise ConfigError(origin, "", f"expected a file in TOML ({error})") from error
    for section, table in content.items():
        if section not in sections:
            raise ConfigError(origin, section, f"no such section; there are {known}")
        if not isinstance(table, dict):
            found = reprlib.repr(table)
            raise ConfigError(origin, section, f"expected a table, [{section}], found {found}")
        for name, value in table.items():
            yield f"{section}.{name}", Given(value, origin)


def in_environment(
    environ: Mapping[str, str], sections: Collection[str]
) -> Iterator[tuple[str, Given]]:
    """Yield what variables say of `sections`, by names such as ``sensor.rate``."""
    for section in sections:
        prefix = f"{_PREFIX}_{section.upper()}_"
        for variable in sorted(environ):
            if variable.startswith(prefix) and environ[variable].strip():
                name = variable.removeprefix(prefix).lower()
                yield f"{section}.{name}", Given(_number(environ[variable]), variable)


def _number(text: str) -> object:
    """Return the number, or the list of them, that `text` is; `text` itself where it is none."""
    for kind in (json.loads,) if text.lstrip().startswith("[") else (int, float):
        try:
            return kind(text)
        except (ValueError, RecursionError):
            continue
    return text
