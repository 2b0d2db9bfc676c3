"""Messages that nobody should believe, sent at a rate: ``python -m benchmarks.faults.flood``.

Damaged, oversized, forged, and such as unfold to much more than they are.
"""

import random
import sys
import time
import zlib
from collections.abc import Iterator

import numpy as np
import zenoh

from mapweave.maps import Alignment, LineMap, RobotMap, Submap, Trajectory
from mapweave.reasons import Reason
from mapweave_protocol.link.session import open_session
from mapweave_protocol.wire import keys
from mapweave_protocol.wire.codec import DEFLATED, MAGIC, MAX_PAYLOAD, VERSION, encode
from mapweave_protocol.wire.dictionary import DICTIONARY
from mapweave_protocol.wire.messages import AlignmentMessage, MapMessage, MapVersion

BOMBS = 100  # among each 10 000
EVERY_BOMB = 100  # one in so many
Sent = tuple[str, bytes]


def room(robot: str, version: int, boot: str = "first") -> RobotMap:
    """Return a map of a room of four walls, of which one grows."""
    ends = np.array([[0, 0], [9, 0], [9, 4], [0, 4 + 0.01 * (version % 300)]], dtype=float)
    walls = np.hstack([ends, np.roll(ends, -1, axis=0)])
    lines = LineMap(walls, np.zeros(4, dtype=np.int64), np.full(4, 20), ())
    path = Trajectory(np.array([0]), np.array([0.0]), np.zeros((1, 3)))
    return RobotMap(robot, boot, version, (Submap(0, 0, np.zeros(3), lines, path),))


def hostile(team: str, count: int, seed: int = 0) -> Iterator[Sent]:
    """Yield keys and payloads, each of which is to be refused."""
    chance = random.Random(seed)
    kinds = (_damaged, _forged, _by_a_stranger, _under_a_hostile_key, _of_another)
    bomb = _bomb()
    for number in range(count):
        if number % EVERY_BOMB == EVERY_BOMB - 1:
            yield keys.MAP.build(team=team, robot="r1"), bomb
        elif number == count // 2:
            yield keys.MAP.build(team=team, robot="r1"), bytes(MAX_PAYLOAD + 1)
        else:
            yield kinds[number % len(kinds)](team, chance)


def _damaged(team: str, chance: random.Random) -> Sent:
    payload = bytearray(encode(MapMessage.pack(room("r1", chance.randrange(1, 99)))))
    del payload[chance.randrange(len(payload)) :]
    return keys.MAP.build(team=team, robot="r1"), bytes(payload)


def _forged(team: str, _: random.Random) -> Sent:
    return keys.MAP.build(team=team, robot="r1"), encode(MapMessage.pack(room("r1", 2**53)))


def _by_a_stranger(team: str, _: random.Random) -> Sent:
    found = Alignment("r1/0", "r2/0", np.zeros(3), "accepted", 0.99, Reason.words("trust me"))
    ends = [MapVersion(robot=robot, boot="first", version=1) for robot in ("r1", "r2")]
    message = AlignmentMessage.pack("stranger", ends[0], ends[1], [found])
    parts = {"robot": "stranger", "reference": "r1", "other": "r2"}
    return keys.ALIGNMENT.build(team=team, **parts), encode(message)


def _under_a_hostile_key(team: str, chance: random.Random) -> Sent:
    name = "r1\nforged line\x1b[2J" + "x" * chance.randrange(3000)
    return keys.STATUS.build(team=team, robot="r1").replace("/r1/", f"/{name}/"), b"?"


def _of_another(team: str, chance: random.Random) -> Sent:
    payload = encode(MapMessage.pack(room("r2", chance.randrange(1, 99))))
    return keys.MAP.build(team=team, robot="r1"), payload


def _bomb() -> bytes:
    """Return some 60 kB that stand for millions of empty maps."""
    row = b"\xdc\x0f\xff" + b"\x80" * 4095
    packer = zlib.compressobj(zlib.Z_BEST_COMPRESSION, zdict=DICTIONARY)
    body = packer.compress(b"\xdc\x0f\xff" + row * 4095) + packer.flush()
    return MAGIC + bytes([VERSION]) + MapMessage.letter + DEFLATED + body


def main(endpoint: str, team: str, count: int, rate: float) -> None:
    """Send so many at so many a second."""
    messages, wait = list(hostile(team, count)), zenoh.CongestionControl.BLOCK
    with open_session([endpoint], patience=30.0) as session:
        started = time.monotonic()
        for number, (key, payload) in enumerate(messages):
            ahead = started + number / rate - time.monotonic()
            if ahead > 0:
                time.sleep(ahead)
            session.put(key, payload, congestion_control=wait)
        print(f"{time.monotonic() - started:.3f}", flush=True)
        time.sleep(1.0)  # what is still being sent


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], int(sys.argv[3]), float(sys.argv[4]))
