#!/usr/bin/env bash
# cyclonedds 11.0.1: a robot that joins late gets one message of a history that is kept in full.
#
# Expected: map parts are written reliably, TransientLocal ("whoever joins later gets what was written
# before") and KeepAll ("of each key all are kept"), on both sides. A robot that joins after ten parts
# gets these ten, as one that was there from the start.
#
# What happens: it gets the tenth. How much is kept for late joiners is told by a third policy,
# DurabilityService, whose own history is KeepLast(1) unless it is set; History is for those that are
# there already. Both sides agree that they match, and those that are there get everything: the map has
# a hole only on robots that were started last. A depth in History, as in KeepLast(100), changes nothing
# either. It is one for each key, so a test with one message per robot passes.
#
# Seen (ten parts under one key; how many a reader gets that was there, and one that comes later):
#   KeepAll                            there 10, later  1
#   KeepLast(100)                      there 10, later  1
#   KeepAll, DurabilityService too     there 10, later 10
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q --disable-pip-version-check --no-cache-dir \
    cyclonedds==11.0.1
"$work/venv/bin/python" - <<'EOF'
import os
import sys
import time
from dataclasses import dataclass

os.environ["CYCLONEDDS_URI"] = """<CycloneDDS><Domain>
<General><Interfaces><NetworkInterface name="lo" multicast="false"/></Interfaces></General>
<Discovery><ParticipantIndex>auto</ParticipantIndex><Peers><Peer address="127.0.0.1"/></Peers>
</Discovery></Domain></CycloneDDS>"""
from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.annotations import key
from cyclonedds.idl.types import uint32
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic

PARTS, DOMAIN, SECONDS = 10, 5, 1_000_000_000
KEPT = Policy.Reliability.Reliable(SECONDS), Policy.Durability.TransientLocal
ALL, HUNDRED = Policy.History.KeepAll, Policy.History.KeepLast(100)
SERVICE = Policy.DurabilityService(0, ALL, -1, -1, -1)
CASES = {
    "KeepAll": Qos(*KEPT, ALL),
    "KeepLast(100)": Qos(*KEPT, HUNDRED),
    "KeepAll, DurabilityService too": Qos(*KEPT, ALL, SERVICE),
}


@dataclass
class Part(IdlStruct, typename="Part"):
    robot: uint32
    key("robot")
    number: uint32


def received(reader):
    """Return how many parts come to a reader within some seconds."""
    count, end = 0, time.monotonic() + 3
    while count < PARTS and time.monotonic() < end:
        count += len(reader.take(N=100))
        time.sleep(0.05)
    return count


def run(qos):
    writing, reading = DomainParticipant(DOMAIN), DomainParticipant(DOMAIN)
    writer = DataWriter(writing, Topic(writing, "parts", Part, qos=qos), qos=qos)
    topic = Topic(reading, "parts", Part, qos=qos)
    there = DataReader(reading, topic, qos=qos)
    end = time.monotonic() + 10
    while not writer.get_matched_subscriptions() and time.monotonic() < end:
        time.sleep(0.05)
    for number in range(PARTS):
        writer.write(Part(1, number))
    first = received(there)
    return first, received(DataReader(reading, topic, qos=qos))


seen = []
for name, qos in CASES.items():
    seen.append(run(qos))
    print(f"{name:33}  there {seen[-1][0]:2}, later {seen[-1][1]:2}")
sys.exit(0 if seen == [(PARTS, 1), (PARTS, 1), (PARTS, PARTS)] else 1)
EOF
