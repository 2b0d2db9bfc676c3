"""What a user may set: by a file, by the environment, and said in one line where it is wrong."""

import math
import pickle
from collections.abc import Iterator
from pathlib import Path
from typing import get_args

import pytest
from annotated_types import Ge, Le
from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo

from mapweave.config import Config, Mapping, Robot, Sensor, Setting, Unit
from mapweave.errors import ConfigError

SECTIONS: dict[str, type[BaseModel]] = {"sensor": Sensor, "robot": Robot, "mapping": Mapping}
FIELDS = [(section, name) for section, model in SECTIONS.items() for name in model.model_fields]
NUMBERS = [each for each in FIELDS if each != ("sensor", "masks")]


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "robot.toml"


def bounds(field: FieldInfo) -> tuple[float, float]:
    (low,) = (each.ge for each in field.metadata if isinstance(each, Ge))
    (high,) = (each.le for each in field.metadata if isinstance(each, Le))
    assert isinstance(low, int | float) and isinstance(high, int | float)
    return low, high


def settings(config: Config) -> dict[str, Setting]:
    return {f"{s.section}.{s.name}": s for s in config.settings()}


def said(file: Path | None, environ: dict[str, str] | None = None) -> str:
    """Return what is said of a configuration that cannot be used: one line."""
    with pytest.raises(ConfigError) as raised:
        Config.load(file, environ)
    (line,) = str(raised.value).splitlines()
    return line


def test_without_file_and_environment_all_values_are_the_defaults() -> None:
    assert Config.load(None, {}) == Config.load() == Config()
    assert {s.origin for s in Config.load().settings()} == {"default"}


def test_the_environment_goes_before_the_file_and_the_file_before_the_defaults(file: Path) -> None:
    file.write_text("[sensor]\nrange_sigma = 0.03\nrate = 10\n[mapping]\npatience = 9\n")
    config = Config.load(file, {"MAPWEAVE_SENSOR_RATE": "20", "MAPWEAVE_ROBOT_MAX_SPEED": "1e0"})
    found = {name: (s.value, s.origin) for name, s in settings(config).items()}
    assert found["sensor.rate"] == (20.0, "MAPWEAVE_SENSOR_RATE")
    assert found["robot.max_speed"] == (1.0, "MAPWEAVE_ROBOT_MAX_SPEED")
    assert found["sensor.range_sigma"] == (0.03, str(file))
    assert found["mapping.patience"] == (9, str(file))
    assert found["mapping.door"] == (0.6, "default")


def test_where_values_come_from_does_not_make_configurations_differ(file: Path) -> None:
    file.write_text("[sensor]\nrate = 10")
    loaded = Config.load(file)
    assert loaded == Config(sensor=Sensor(rate=10)) != Config()
    assert hash(loaded) == hash(Config(sensor=Sensor(rate=10)))


def test_a_configuration_goes_to_another_process_with_its_origins(file: Path) -> None:
    file.write_text("[sensor]\nrate = 10")
    config = Config.load(file)
    there = pickle.loads(pickle.dumps(config))
    assert list(there.settings()) == list(config.settings())


def test_a_variable_that_is_empty_and_other_variables_say_nothing() -> None:
    environ = {"MAPWEAVE_SENSOR_RATE": " ", "MAPWEAVE_DATA": "3", "MAPWEAVE_SENSORS": "x"}
    assert Config.load(None, environ) == Config()


@pytest.mark.parametrize(("section", "name"), NUMBERS)
def test_every_setting_has_a_unit_a_description_and_bounds_around_its_default(
    section: str, name: str
) -> None:
    field = SECTIONS[section].model_fields[name]
    (unit,) = (each for each in field.metadata if isinstance(each, Unit))
    low, high = bounds(field)
    assert field.description
    assert unit.name in ("m", "rad", "Hz", "m/s", "rad/s", "")
    if field.default is None:
        assert type(None) in get_args(field.annotation)
    else:
        assert low <= field.default < high


def out_of_bounds() -> Iterator[tuple[str, str, str]]:
    for section, name in NUMBERS:
        low, high = bounds(SECTIONS[section].model_fields[name])
        whole = isinstance(SECTIONS[section].model_fields[name].default, int)
        beyond = 1 if whole else 1e-6
        for value in (low - beyond, high + beyond):
            yield section, name, repr(value)


@pytest.mark.parametrize(("section", "name", "value"), list(out_of_bounds()))
def test_a_value_out_of_bounds_is_refused_with_what_was_expected(
    section: str, name: str, value: str, file: Path
) -> None:
    file.write_text(f"[{section}]\n{name} = {value}")
    line = said(file)
    assert line.startswith(f"{file}: {section}.{name}: expected a ")
    assert line.endswith(f", found {value}") and " from " in line


@pytest.mark.parametrize(
    ("text", "rest"),
    [
        (
            "[sensor]\nrange_sigma = 'much'",
            "sensor.range_sigma: expected a number from 0.001 to 0.2 [m], found 'much'",
        ),
        ("[sensor]\nrate = true", "sensor.rate: expected a number from 0.1 to 1000 [Hz]"),
        ("[sensor]\nmax_range = inf", "sensor.max_range: expected a number from 0.1 to 1000 [m]"),
        ("[sensor]\nmax_range = nan", "sensor.max_range: expected a number from 0.1 to 1000 [m]"),
        ("[sensor]\nrate = [1]", "sensor.rate: expected a number from 0.1 to 1000 [Hz]"),
        ("[sensor]\nmasks = 3", "sensor.masks: expected pairs of directions from -360 to 360 [°]"),
        ("[sensor]\nmasks = [90, 100]", "sensor.masks: expected pairs of directions"),
        ("[sensor]\nmasks = [[90, 361]]", "sensor.masks: expected pairs of directions"),
        ("[sensor]\nmasks = [[90, 100, 110]]", "sensor.masks: expected pairs of directions"),
        (f"[sensor]\nmasks = {'[' * 5000}", "expected a file in TOML ("),
        (f"[sensor]\nmasks = {[[0, 1]] * 33}", "sensor.masks: expected pairs of directions"),
        ("[mapping]\npatience = 2.5", "mapping.patience: expected a whole number from 1 to 1000"),
        (
            "[robot]\nspeed = 1",
            "robot.speed: no such field; there are max_speed, max_turn_rate",
        ),
        ("[lidar]\nx = 1", "lidar: no such section; there are sensor, robot, mapping"),
        ("sensor = 3", "sensor: expected a table, [sensor], found 3"),
        ("[sensor", "expected a file in TOML ("),
        ("\udcff", "expected a file in TOML ("),
    ],
)
def test_a_file_that_is_wrong_is_named_with_the_field_and_what_was_expected(
    text: str, rest: str, file: Path
) -> None:
    file.write_bytes(text.encode("utf-8", "surrogateescape"))
    assert said(file).startswith(f"{file}: {rest}")


def test_a_file_that_cannot_be_read_is_named(tmp_path: Path) -> None:
    assert said(tmp_path / "none.toml").startswith(f"{tmp_path / 'none.toml'}: cannot be read (")
    assert said(tmp_path).startswith(f"{tmp_path}: cannot be read (")


@pytest.mark.parametrize(
    ("variable", "value", "rest"),
    [
        ("MAPWEAVE_SENSOR_RATE", "fast", "sensor.rate: expected a number from 0.1 to 1000 [Hz]"),
        ("MAPWEAVE_SENSOR_RATE", "-1", "sensor.rate: expected a number"),
        ("MAPWEAVE_SENSOR_RANGE", "1", "sensor.range: no such field; there are range_sigma, "),
        ("MAPWEAVE_MAPPING_PATIENCE", "1.5", "mapping.patience: expected a whole number"),
    ],
)
def test_a_variable_that_is_wrong_is_named(variable: str, value: str, rest: str) -> None:
    assert said(None, {variable: value}).startswith(f"{variable}: {rest}")


def test_a_wrong_value_in_the_file_is_not_blamed_on_the_environment(file: Path) -> None:
    file.write_text("[sensor]\nrate = -1")
    assert said(file, {"MAPWEAVE_SENSOR_MAX_RANGE": "8"}).startswith(f"{file}: sensor.rate: ")


def test_a_value_given_by_a_program_is_checked_in_one_line_as_well() -> None:
    with pytest.raises(ConfigError, match=r"^robot\.max_speed: expected .* \[m/s\], found 0$"):
        Robot(max_speed=0)


@pytest.mark.parametrize(
    ("values", "line"),
    [
        ({"robot": 5}, "robot: expected values of max_speed, max_turn_rate, found 5"),
        ({"lidar": {}}, "config.lidar: no such field; there are sensor, robot, mapping"),
        ({"sensor": {"rate": "x"}}, "sensor.rate: expected a number from 0.1 to 1000 [Hz]"),
    ],
)
def test_sections_given_by_a_program_are_checked_in_one_line(
    values: dict[str, object], line: str
) -> None:
    with pytest.raises(ConfigError) as raised:
        Config.model_validate(values)
    assert str(raised.value).startswith(line)


def test_a_configuration_is_not_changed_once_it_is_made() -> None:
    config = Config()
    with pytest.raises(ValidationError, match="frozen"):
        config.sensor.range_sigma = 0.1  # type: ignore[misc]  # that is the point
    assert config.sensor.range_sigma == 0.02


def test_the_robot_turns_by_half_a_turn_a_second_and_drives_2_m_by_default() -> None:
    assert (Config().robot.max_turn_rate, Config().robot.max_speed) == (math.pi, 2.0)


def test_the_directions_in_which_a_sensor_sees_its_robot_are_pairs_of_degrees(file: Path) -> None:
    file.write_text("[sensor]\nmasks = [[100, 140.5], [-140, -100]]")
    pairs = [[100.0, 140.5], [-140.0, -100.0]]
    assert Config.load(file).values()["sensor"]["masks"] == pairs
    variable = {"MAPWEAVE_SENSOR_MASKS": " [[100, 140.5], [-140, -100]]"}
    assert Config.load(None, variable) == Config.load(file)
    assert hash(Config.load(None, variable)) == hash(Config.load(file))


@pytest.mark.parametrize("value", ["[", "[" * 100_000, "[[1]]", "[[1, true]]", "[[null, 1]]", "x"])
def test_what_is_no_pair_of_degrees_is_refused_from_the_environment_too(value: str) -> None:
    line = said(None, {"MAPWEAVE_SENSOR_MASKS": value})
    assert line.startswith("MAPWEAVE_SENSOR_MASKS: sensor.masks: expected pairs of directions")
    assert len(line) < 200


def test_a_sensor_whose_every_reading_would_be_left_out_is_refused(file: Path) -> None:
    file.write_text("[sensor]\nrange_min = 5\n")
    line = said(file, {"MAPWEAVE_SENSOR_MAX_RANGE": "5"})
    assert line == (
        f"{file}: sensor.range_min: expected less than max_range, 5 m, found 5: no reading would"
        " count"
    )
    assert Config.load(file, {"MAPWEAVE_SENSOR_MAX_RANGE": "5.1"}).sensor.range_min == 5


def test_a_file_is_named_by_its_path_or_in_words(file: Path) -> None:
    file.write_text("[mapping]\npatience = 9\n")
    assert Config.load(str(file)) == Config.load(file)
