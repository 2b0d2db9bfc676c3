"""What tests of several packages share."""

import os
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import settings

from mapweave.kernels.loading import missing

settings.register_profile("busy", deadline=None)  # on a busy machine an example may take its time
settings.load_profile("busy")

DATA = Path(os.environ.get("MAPWEAVE_DATA", Path(__file__).parents[2] / "shared" / "data"))


def pytest_report_header() -> list[str]:
    """Say where tests of kernels are those of their twins."""
    return [told] if (told := missing()) else []


@pytest.fixture
def data_dir() -> Path:
    """Return the folder of real laser logs, or skip: they may not be redistributed."""
    if not DATA.is_dir():
        pytest.skip(f"no real laser logs at {DATA}; name their folder with MAPWEAVE_DATA")
    return DATA


@pytest.fixture(scope="session", autouse=True)
def _state_elsewhere(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Have agents keep their runs where the tests' files are, not in the user's home."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_STATE_HOME", str(tmp_path_factory.mktemp("state")))
        yield
