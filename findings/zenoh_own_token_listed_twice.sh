#!/usr/bin/env bash
# eclipse-zenoh 1.10.2: a client that asks who is alive finds itself in the answer twice.
#
# Expected: `liveliness().get` lists the tokens that match; a token is declared once, by one
# session, so a list of robots can be counted: five answers are five robots. Queries in general
# merge answers of the same key by default.
#
# What happens: the session answers for its own token, and so does the router that knows it too; the
# two are not merged. All others see it once, and a liveliness subscriber of the same session is
# told once. A robot that counts its team is one robot too many, and one that is alone has company.
#
# Seen:
#   asked by the robot itself: ['team/r1/alive', 'team/r1/alive', 'team/r2/alive']
#   asked by another robot:    ['team/r1/alive', 'team/r2/alive', 'team/r2/alive']
#   asked by a third party:    ['team/r1/alive', 'team/r2/alive']
#   told to a subscriber of the robot itself: ['team/r1/alive', 'team/r2/alive']
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

with socket.socket() as taken:
    taken.bind(("127.0.0.1", 0))
    endpoint = json.dumps([f"tcp/127.0.0.1:{taken.getsockname()[1]}"])


def session(mode):
    config = zenoh.Config()
    config.insert_json5("mode", json.dumps(mode))
    config.insert_json5("scouting/multicast/enabled", "false")
    config.insert_json5("listen/endpoints" if mode == "router" else "connect/endpoints", endpoint)
    return zenoh.open(config)


def alive(where):
    return sorted(str(reply.ok.key_expr) for reply in where.liveliness().get("team/*/alive"))


told = []
with (
    session("router"),
    session("client") as r1,
    session("client") as r2,
    session("client") as watcher,
):
    tokens = [r1.liveliness().declare_token("team/r1/alive")]
    tokens.append(r2.liveliness().declare_token("team/r2/alive"))
    time.sleep(1)
    asked = {name: alive(s) for name, s in {"r1": r1, "r2": r2, "watcher": watcher}.items()}
    subscriber = r1.liveliness().declare_subscriber(
        "team/*/alive", lambda sample: told.append(str(sample.key_expr)), history=True
    )
    time.sleep(1)
    subscriber.undeclare()
print(f"asked by the robot itself: {asked['r1']}")
print(f"asked by another robot:    {asked['r2']}")
print(f"asked by a third party:    {asked['watcher']}")
print(f"told to a subscriber of the robot itself: {sorted(told)}")
R1, R2 = "team/r1/alive", "team/r2/alive"
same = asked == {"r1": [R1, R1, R2], "r2": [R1, R2, R2], "watcher": [R1, R2]}
sys.exit(0 if same and sorted(told) == [R1, R2] else 1)
EOF
