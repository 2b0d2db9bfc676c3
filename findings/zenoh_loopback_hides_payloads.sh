#!/usr/bin/env bash
# eclipse-zenoh 1.10.2: measured on one machine, most of what a robot would send is not on the link.
#
# Expected: two sessions that are joined by a TCP endpoint send each other what they publish by that
# connection. A count of its bytes is what a radio would have to carry, headers and all; that is how
# one compares formats of maps before there are robots.
#
# What happens: sessions that find themselves on one machine pass payloads of 3 kB and more by shared
# memory, by default and without a word; over TCP goes where in memory they are. A map of 20 kB costs
# 1 to 5 kB of link at a desk and 20 kB in the field, while a map of 3 kB costs 3 kB in both: the
# larger format looks nearly as good as the small one. `transport/shared_memory/enabled: false` on
# either side makes the count that of two machines.
#
# Seen (20 maps each, put by a client, counted by a relay on its way to the router):
#   size      as it is     without shared memory
#   3000 B       60 kB        60 kB
#   20000 B      21 kB       400 kB
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

MAPS, SMALL, LARGE = 20, 3_000, 20_000


def carry(source, sink, note):
    try:
        while data := source.recv(65536):
            note(len(data))
            sink.sendall(data)
    except OSError:
        return


def relay(port, sizes):
    """Return the port of a relay to `port` that notes what goes to it."""
    listener = socket.create_server(("127.0.0.1", 0))

    def accept():
        client, _ = listener.accept()
        server = socket.create_connection(("127.0.0.1", port))
        threading.Thread(target=carry, args=(server, client, lambda _: None), daemon=True).start()
        carry(client, server, sizes.append)

    threading.Thread(target=accept, daemon=True).start()
    return listener.getsockname()[1]


def session(mode, side, port, shared):
    config = zenoh.Config()
    config.insert_json5("mode", json.dumps(mode))
    config.insert_json5("scouting/multicast/enabled", "false")
    config.insert_json5(f"{side}/endpoints", json.dumps([f"tcp/127.0.0.1:{port}"]))
    if not shared:
        config.insert_json5("transport/shared_memory/enabled", "false")
    return zenoh.open(config)


def on_the_link(size, shared):
    """Return the bytes by which a client's maps reached the router [kB]."""
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        port = taken.getsockname()[1]
    sizes, got = [], []
    with session("router", "listen", port, True) as router:
        subscriber = router.declare_subscriber("team/*/map", lambda s: got.append(len(s.payload)))
        with session("client", "connect", relay(port, sizes), shared) as robot:
            time.sleep(1)
            before = sum(sizes)
            for _ in range(MAPS):
                robot.put("team/r1/map", os.urandom(size))
                time.sleep(0.05)
            time.sleep(1)
            sent = sum(sizes) - before
        subscriber.undeclare()
    assert got == [size] * MAPS, got
    return sent / 1000


print("size       as it is   without shared memory")
seen = {}
for size in (SMALL, LARGE):
    seen[size] = [on_the_link(size, shared) for shared in (True, False)]
    print(f"{size:5} B  {seen[size][0]:7.0f} kB  {seen[size][1]:7.0f} kB")
least = {size: MAPS * size / 1000 for size in seen}
small = all(kilobytes >= least[SMALL] for kilobytes in seen[SMALL])
hidden = seen[LARGE][0] < least[LARGE] / 2 and seen[LARGE][1] >= least[LARGE]
sys.exit(0 if small and hidden else 1)
EOF
