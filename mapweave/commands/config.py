"""``mapweave config``: the effective configuration, and where each value comes from."""

import argparse
from collections.abc import Iterator
from itertools import groupby

from mapweave.cli import Command, add_config_argument, add_json_argument, config_of, say
from mapweave.config import Config, Setting

WIDTH = 24  # columns of a setting, before what is said of it


def _configure(parser: argparse.ArgumentParser) -> None:
    add_config_argument(parser)
    add_json_argument(parser)


def _run(options: argparse.Namespace) -> int:
    config = config_of(options)
    say(options, _as_json(config), tell(config))
    return 0


def tell(config: Config) -> Iterator[str]:
    """Yield the lines of a file in TOML that says the same; comments tell unit and origin."""
    for number, (section, settings) in enumerate(groupby(config.settings(), lambda s: s.section)):
        yield from ["", f"[{section}]"] if number else [f"[{section}]"]
        yield from map(_tell, settings)


def _tell(setting: Setting) -> str:
    unit = f"[{setting.unit}] " if setting.unit else ""
    said = f"# {unit}{setting.description} ({setting.origin})"
    if setting.value is None:  # TOML has no word for it
        return f"{f'# {setting.name} unset':<{WIDTH}} {said}"
    return f"{f'{setting.name} = {setting.value}':<{WIDTH}} {said}"


def _as_json(config: Config) -> dict[str, dict[str, object]]:
    return {
        section: {
            s.name: {
                "value": s.value,
                "unit": s.unit,
                "from": s.origin,
                "description": s.description,
            }
            for s in settings
        }
        for section, settings in groupby(config.settings(), lambda s: s.section)
    }


command = Command(
    "Show the configuration, and where each value comes from.", _configure, _run, "--config my.toml"
)
