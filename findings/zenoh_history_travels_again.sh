#!/usr/bin/env bash
# eclipse-zenoh 1.10.2: after an outage a subscriber that missed nothing is sent all of the cache again.
#
# Expected: advanced samples are numbered per publisher, and an advanced subscriber knows which it
# has. When the link is back after an outage in which nothing was published, nothing is to be sent;
# `HistoryConfig(detect_late_publishers=True)` sounds as if it were for publishers that are new.
#
# What happens: the publisher's announcement comes anew with the link, and the subscriber asks it for
# its history whole, whatever it has. The copies are dropped on arrival, so no program sees them; the
# radio carries them. A robot with a cache of twenty maps and three listeners sends sixty maps after
# each second of bad reception. `max_samples` of HistoryConfig bounds it, and bounds with it what a
# real outage brings back.
#
# Seen (20 samples of 20 kB, shared memory off; bytes from publisher to subscriber, counted by a relay between them):
#   first        20 samples delivered, about 400 kB
#   outage       0 samples delivered, about 400 kB
#   outage       0 samples delivered, about 400 kB
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q --disable-pip-version-check --no-cache-dir eclipse-zenoh==1.10.2
"$work/venv/bin/python" - <<'EOF'
import json
import os
import socket
import sys
import threading
import time

import zenoh
import zenoh.ext as ze

SAMPLES, SIZE = 20, 20_000


class Relay:
    """Passes on what comes, counts what goes to the client, and can cut the link."""

    def __init__(self, target):
        self.target, self.links, self.down = target, [], 0
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.port, self.open = self.listener.getsockname()[1], True
        threading.Thread(target=self.accept, daemon=True).start()

    def accept(self):
        while True:
            client, _ = self.listener.accept()
            if not self.open:
                client.close()
                continue
            server = socket.create_connection(("127.0.0.1", self.target))
            self.links += [client, server]
            for ends in ((client, server, False), (server, client, True)):
                threading.Thread(target=self.carry, args=ends, daemon=True).start()

    def carry(self, source, sink, counted):
        try:
            while data := source.recv(65536):
                if counted:
                    self.down += len(data)
                sink.sendall(data)
        except OSError:
            return

    def cut(self, seconds):
        self.open = False
        for link in self.links:
            link.shutdown(socket.SHUT_RDWR)
            link.close()
        self.links.clear()
        time.sleep(seconds)
        self.open = True


def session(mode, side, port):
    config = zenoh.Config()
    config.insert_json5("mode", json.dumps(mode))
    config.insert_json5("scouting/multicast/enabled", "false")
    config.insert_json5("transport/shared_memory/enabled", "false")  # as between two machines
    config.insert_json5(f"{side}/endpoints", json.dumps([f"tcp/127.0.0.1:{port}"]))
    return zenoh.open(config)


with socket.socket() as taken:
    taken.bind(("127.0.0.1", 0))
    port = taken.getsockname()[1]
relay, got = Relay(port), []
with session("router", "listen", port), session("client", "connect", port) as robot:
    publisher = ze.declare_advanced_publisher(
        robot,
        "team/r1/map",
        cache=ze.CacheConfig(max_samples=SAMPLES),
        sample_miss_detection=ze.MissDetectionConfig(sporadic_heartbeat=0.5),
        publisher_detection=True,
    )
    with session("client", "connect", relay.port) as watcher:
        subscriber = ze.declare_advanced_subscriber(
            watcher,
            "team/*/map",
            got.append,
            history=ze.HistoryConfig(detect_late_publishers=True, max_samples=SAMPLES),
            recovery=ze.RecoveryConfig(heartbeat=True),
        )
        time.sleep(1)
        for _ in range(SAMPLES):
            publisher.put(os.urandom(SIZE))
        time.sleep(2)
        seen = [(len(got), relay.down)]
        for _ in range(2):
            before = len(got), relay.down
            relay.cut(3)
            time.sleep(6)
            seen.append((len(got) - before[0], relay.down - before[1]))
        subscriber.undeclare()
for name, (count, size) in zip(("first", "outage", "outage"), seen, strict=True):
    print(f"{name:10} {count:3} samples delivered, {size / 1000:4.0f} kB")
counts = [count for count, _ in seen] == [SAMPLES, 0, 0]
whole = all(0.9 < size / (SAMPLES * SIZE) < 1.5 for _, size in seen)
sys.exit(0 if counts and whole else 1)
EOF
