#!/usr/bin/env bash
# eclipse-zenoh 1.10.2: `max_age` of a history bounds nothing where samples have no time, as by default.
#
# Expected: `HistoryConfig(max_age=4)` is "the maximum age of samples to query in seconds". Who joins a
# team late wants poses and orders of the last seconds, and none of ten minutes ago.
#
# What happens: the publisher's cache compares the age with a sample's timestamp, and gives out each
# that has none. Clients and peers stamp nothing unless `timestamping/enabled` is set where the
# publisher is. A router stamps what passes through, so whoever was there from the start sees
# timestamps and takes them to be on; the cache is on the other side of it. All that is cached comes,
# however old, and without a time that would tell. A late robot plans around where another one was;
# a test with fresh samples sees no difference. With stamps the bound holds.
#
# Seen (a pose, six seconds, and another; then a subscriber with max_age of 4 s):
#   publisher as it is:         [b'old', b'new'], the second one stamped to who was there: True
#   with timestamping/enabled:  [b'new'], the second one stamped to who was there: True
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q --disable-pip-version-check --no-cache-dir eclipse-zenoh==1.10.2
"$work/venv/bin/python" - <<'EOF'
import json
import socket
import sys
import time

import zenoh
import zenoh.ext as ze

AGE, PAUSE = 4.0, 6.0  # [s]
with socket.socket() as taken:
    taken.bind(("127.0.0.1", 0))
    endpoint = json.dumps([f"tcp/127.0.0.1:{taken.getsockname()[1]}"])


def session(mode, *, stamped=False):
    config = zenoh.Config()
    config.insert_json5("mode", json.dumps(mode))
    config.insert_json5("scouting/multicast/enabled", "false")
    config.insert_json5("listen/endpoints" if mode == "router" else "connect/endpoints", endpoint)
    if stamped:
        config.insert_json5("timestamping/enabled", "true")
    return zenoh.open(config)


def joined_late(*, stamped):
    """Return what a subscriber gets that asks for the last seconds, and the stamps of another."""
    got, stamps = [], []
    with session("client", stamped=stamped) as robot, session("client") as other:
        early = other.declare_subscriber("team/*/pose", lambda s: stamps.append(s.timestamp))
        publisher = ze.declare_advanced_publisher(
            robot,
            "team/r1/pose",
            cache=ze.CacheConfig(max_samples=10),
            sample_miss_detection=ze.MissDetectionConfig(),
            publisher_detection=True,
        )
        publisher.put(b"old")
        time.sleep(PAUSE)
        publisher.put(b"new")
        subscriber = ze.declare_advanced_subscriber(
            other,
            "team/*/pose",
            lambda sample: got.append(bytes(sample.payload)),
            history=ze.HistoryConfig(detect_late_publishers=True, max_age=AGE),
        )
        until = time.monotonic() + 5
        while b"new" not in got and time.monotonic() < until:
            time.sleep(0.1)
        time.sleep(0.5)
        subscriber.undeclare()
        early.undeclare()
    return got, stamps[-1] is not None


with session("router"):
    plain, stamped = joined_late(stamped=False), joined_late(stamped=True)
for name, (got, told) in {
    "publisher as it is:": plain,
    "with timestamping/enabled:": stamped,
}.items():
    print(f"{name:27} {got}, the second one stamped to who was there: {told}")
sys.exit(0 if plain == ([b"old", b"new"], True) and stamped == ([b"new"], True) else 1)
EOF
