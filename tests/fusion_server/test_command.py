"""What `mapweave server` makes of its arguments before it connects to anything."""

import socket
import subprocess
import sys
from contextlib import nullcontext
from pathlib import Path
from unittest.mock import Mock

import pytest

from mapweave.cli import main
from mapweave.config import Config, Mapping
from mapweave_fusion_server import command, web


def test_a_file_that_is_no_store_ends_the_command_with_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    diary = tmp_path / "diary.txt"
    diary.write_text("dear diary")
    assert main(["server", "--store", str(diary)]) == 1
    [line] = capsys.readouterr().err.splitlines()
    assert str(diary) in line
    assert diary.read_text() == "dear diary"


def test_a_team_that_is_no_id_ends_the_command_with_one_line(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["server", "--team", "No Team"]) == 1
    [line] = capsys.readouterr().err.splitlines()
    assert "team 'No Team'" in line


@pytest.mark.parametrize("interval", ["-1", "nan", "inf", "soon"])
def test_an_interval_that_is_none_is_wrong_usage(
    interval: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["server", "--min-interval", interval])
    assert ended.value.code == 2
    assert "_seconds" not in capsys.readouterr().err


def test_the_service_gets_the_configuration(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    service = Mock()
    monkeypatch.setattr(command, "open_session", Mock(return_value=nullcontext()))
    monkeypatch.setattr(command, "Service", service)
    monkeypatch.setenv("MAPWEAVE_MAPPING_MAX_GAP", "0.7")
    assert main(["server", "--store", str(tmp_path / "store")]) == 0
    assert Config(mapping=Mapping(max_gap=0.7)) in service.call_args.args


@pytest.mark.parametrize("address", ["example.org:80", "8080"])
def test_an_address_that_is_none_of_this_machine_is_wrong_usage(
    address: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["server", "--http", address])
    assert ended.value.code == 2
    assert f"argument --http: {address}: " in capsys.readouterr().err


def test_an_address_that_is_taken_ends_the_command_with_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        store = str(tmp_path / "store")
        assert main(["server", "--store", store, "--http", f"127.0.0.1:{port}"]) == 1
    last = capsys.readouterr().err.splitlines()[-1]
    assert last == f"mapweave: --http: 127.0.0.1:{port}: Address already in use"


@pytest.mark.parametrize("package", ["starlette.applications", "uvicorn", "prometheus_client"])
def test_without_the_extra_the_page_is_refused_in_one_line(
    package: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(sys.modules, package, None)
    for name in ("web.server", "monitoring"):
        monkeypatch.delitem(sys.modules, f"mapweave_fusion_server.{name}", raising=False)
    monkeypatch.delattr(web, "server", raising=False)
    store = str(tmp_path / "store")
    assert main(["server", "--store", store, "--http", "127.0.0.1:0"]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert "mapweave[web]" in line


def test_a_coordinator_without_a_page_imports_no_web_server() -> None:
    code = (
        "import sys; import mapweave_fusion_server.command, mapweave_fusion_server.service;"
        "print(sorted({'starlette', 'uvicorn', 'anyio'} & set(sys.modules)))"
    )
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert told.stdout.strip() == "[]"
