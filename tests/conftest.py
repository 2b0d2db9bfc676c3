"""What tests of several packages share."""

import os
from pathlib import Path

import pytest
from hypothesis import settings

settings.register_profile("busy", deadline=None)  # on a busy machine an example may take its time
settings.load_profile("busy")

DATA = Path(os.environ.get("MAPWEAVE_DATA", Path(__file__).parents[2] / "shared" / "data"))


@pytest.fixture
def data_dir() -> Path:
    """Return the folder of real laser logs, or skip: they may not be redistributed."""
    if not DATA.is_dir():
        pytest.skip(f"no real laser logs at {DATA}; name their folder with MAPWEAVE_DATA")
    return DATA
