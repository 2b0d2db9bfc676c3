"""Follow a team's joint map, version by version: ``python subscribe.py TEAM [ENDPOINT]``.

Needs a router and a coordinator, as ``mapweave team`` or ``mapweave router`` and ``mapweave
server`` start them. Ends with Ctrl-C.
"""

import sys

import mapweave_protocol

if len(sys.argv) < 2:
    raise SystemExit("usage: python subscribe.py TEAM [ENDPOINT]")
team, *endpoints = sys.argv[1:]
try:
    for joint in mapweave_protocol.joint_maps(team, connect=endpoints or None):
        for component in joint.components:
            print(
                f"version {joint.version}: {', '.join(component.robots)}:"
                f" {len(component.map.segments)} segments,"
                f" confidence {component.confidence:.2f}",
                flush=True,
            )
except KeyboardInterrupt:
    print("interrupted", file=sys.stderr)
