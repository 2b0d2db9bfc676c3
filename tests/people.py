"""What a person types at a running team."""

import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import mapweave_protocol
from mapweave.maps import JointMap

MAPWEAVE = Path(sys.executable).with_name("mapweave")
PATIENCE = 90.0  # [s] for a machine with much else to do


@dataclass(frozen=True)
class Operator:
    """Somebody at a terminal."""

    team: str
    endpoint: str
    name: str = "anna"

    def types(self, *words: str) -> subprocess.CompletedProcess[str]:
        """Run ``mapweave`` with these words, and say which team and router are meant."""
        return subprocess.run(
            [MAPWEAVE, *words, "--team", self.team, "--connect", self.endpoint],
            capture_output=True,
            text=True,
            check=False,
            timeout=PATIENCE,
            env={**os.environ, "MAPWEAVE_OPERATOR": self.name},
        )

    def orders(self, *words: str) -> str:
        """As `types`, and it succeeds; return what was said."""
        done = self.types(*words)
        assert done.returncode == 0, done.stderr
        return done.stdout

    def sees(self) -> JointMap | None:
        """Return the latest joint map, None if there is none."""
        maps = mapweave_protocol.joint_maps(self.team, connect=[self.endpoint], timeout=5.0)
        return next(maps, None)

    def latest(self) -> JointMap:
        """Return the latest joint map there is."""
        joint = self.sees()
        assert joint is not None
        return joint
