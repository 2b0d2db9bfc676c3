#!/usr/bin/env bash
# eclipse-zenoh 1.10.2: who joins late gets a deletion as a PUT with an empty payload.
#
# Expected: a sample has a kind, PUT or DELETE, and an advanced publisher's cache keeps its last
# samples for those who join later: "the last values, as if they had been there". A robot that takes
# its map back with `publisher.delete()` is then seen as DELETE by all, early or late.
#
# What happens: subscribers that are there see DELETE. The cache answers queries, and a deletion in
# its answer is a PUT without a byte, so the one who joined late, or was away, has to decode an
# empty message: an error at best, and for formats in which nothing is a valid value (a string, an
# all-default protobuf message) a map that is empty but there. With and without timestamps.
#
# Seen:
#   there from the start: [('PUT', b'map'), ('DELETE', b'')]
#   joined later:         [('PUT', b'')]
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

with socket.socket() as taken:
    taken.bind(("127.0.0.1", 0))
    endpoint = json.dumps([f"tcp/127.0.0.1:{taken.getsockname()[1]}"])


def session(mode):
    config = zenoh.Config()
    config.insert_json5("mode", json.dumps(mode))
    config.insert_json5("scouting/multicast/enabled", "false")
    config.insert_json5("listen/endpoints" if mode == "router" else "connect/endpoints", endpoint)
    return zenoh.open(config)


def listen(where, into):
    return ze.declare_advanced_subscriber(
        where,
        "team/*/map",
        lambda sample: into.append((str(sample.kind).rpartition('.')[2], bytes(sample.payload))),
        history=ze.HistoryConfig(detect_late_publishers=True),
    )


early, late = [], []
with session("router"), session("client") as robot, session("client") as watcher:
    first = listen(watcher, early)
    publisher = ze.declare_advanced_publisher(
        robot,
        "team/r1/map",
        cache=ze.CacheConfig(max_samples=1),
        sample_miss_detection=ze.MissDetectionConfig(),
        publisher_detection=True,
    )
    time.sleep(0.7)
    publisher.put(b"map")
    publisher.delete()
    time.sleep(0.7)
    second = listen(watcher, late)
    time.sleep(1)
    first.undeclare()
    second.undeclare()
print(f"there from the start: {early}")
print(f"joined later:         {late}")
same = early == [("PUT", b"map"), ("DELETE", b"")] and late == [("PUT", b"")]
sys.exit(0 if same else 1)
EOF
