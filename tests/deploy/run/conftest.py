"""Teams of real processes, under keys and without."""

from datetime import UTC, datetime
from pathlib import Path

import pytest

from mapweave_deploy.keys.team_keys import make_keys
from mapweave_protocol.link.security.roster import Roster


@pytest.fixture(params=["open", "with keys"])
def keys(
    request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Path | None:
    """Return the team's keys, or None for an open router; what the test asks, it asks as a viewer.

    Under keys the router's access rules hold, which have to let pass what heals an outage.
    """
    if request.param == "open":
        return None
    folder = tmp_path / "keys"
    list(make_keys(Roster("t", ("r1", "r2"), (), ("me",)), folder, datetime.now(UTC), 1, []))
    monkeypatch.setenv("MAPWEAVE_TLS", str(folder / "viewers" / "me"))
    return folder
