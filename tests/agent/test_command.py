"""What `mapweave agent` makes of its configuration."""

from contextlib import nullcontext
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest

from mapweave.cli import main
from mapweave.config import Config
from mapweave.fusion.align import FusionParameters, align
from mapweave.mapping.mapper import MapperParameters
from mapweave_agent import command, taking_up
from mapweave_agent.stored import mappers


def test_mapper_backend_comparisons_and_log_get_what_the_configuration_says(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file, log = tmp_path / "robot.toml", tmp_path / "log"
    file.write_text("[sensor]\nrange_sigma = 0.03\nangular_step = 0.01\n")
    log.write_bytes(b"FLASER 5 1.5 2.5 3.5 4.5 5.5 1 2 0.5 3 4 0.25 17.5 host 0.1\n")
    made = {
        name: Mock(return_value=nullcontext())
        for name in ("ComparisonWorker", "BackendProcess", "open_session")
    }
    backend = made.pop("BackendProcess")
    monkeypatch.setattr(mappers, "BackendProcess", backend)
    monkeypatch.setattr(taking_up, "ask_robot_map", Mock(return_value=None))
    for name, mock in {**made, "AgentRun": (agent := Mock())}.items():
        monkeypatch.setattr(command, name, mock)
    assert main(["agent", "--robot", "a", "--log", str(log), "--config", str(file)]) == 0
    config = Config.load(file)
    mapper = agent.call_args.args[2]
    assert mapper.parameters == MapperParameters.of(config)
    assert mapper.robot_map().made_with.config == config.values()
    assert backend.call_args.args == (mapper.parameters.backend, ())
    (compare,) = made["ComparisonWorker"].call_args.args
    assert compare.func is align
    assert compare.keywords == {"parameters": FusionParameters.of(config)}
    (scan,) = agent.return_value.run.call_args.args[0]
    np.testing.assert_allclose(np.diff(scan.angles), 0.01)


def test_odometry_of_a_recording_is_refused_for_a_topic_with_what_is_expected(
    capsys: pytest.CaptureFixture[str],
) -> None:
    given = ["--robot", "a", "--source", "ros2:/scan", "--odometry", "prior"]
    assert main(["agent", *given]) == 1
    assert (
        "--odometry: prior is that of a recording; expected ros2:/odom" in capsys.readouterr().err
    )
