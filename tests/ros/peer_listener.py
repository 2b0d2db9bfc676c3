"""``python peer_listener.py HOST PORT FOLDER DOMAIN``: `zenoh-ros2-sdk` hears maps of robot r1.

A ROS 2 program that mapweave has no part in: it finds topics by its own keys and hashes, and
decodes messages by itself. Of each topic it prints the first message as a line of JSON, and ends.
"""

import json
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import zenoh_ros2_sdk
from rosbags.typesys import Stores, get_typestore
from zenoh_ros2_sdk.message_registry import get_registry
from zenoh_ros2_sdk.session import ZenohSession

Made = Any
PATIENCE = 60.0  # [s]


def of_grid(message: Made) -> dict[str, Any]:
    """Return what a grid says."""
    info, origin = message.info, message.info.origin.position
    cells = [int(cell) for cell in message.data]
    return {"size": [info.width, info.height], "origin": [origin.x, origin.y], "cells": cells}


def of_walls(message: Made) -> dict[str, Any]:
    """Return the ends of lines that markers show as walls."""
    shown = [marker for marker in message.markers if marker.ns == "walls"]
    return {"ends": [[point.x, point.y] for marker in shown for point in marker.points]}


def of_transforms(message: Made) -> dict[str, Any]:
    """Return parents and children."""
    return {"frames": [[t.header.frame_id, t.child_frame_id] for t in message.transforms]}


HEARD: dict[str, tuple[str, Callable[[Made], dict[str, Any]]]] = {
    "/r1/map": ("nav_msgs/msg/OccupancyGrid", of_grid),
    "/r1/walls": ("visualization_msgs/msg/MarkerArray", of_walls),
    "/tf": ("tf2_msgs/msg/TFMessage", of_transforms),
}


def write_definitions(folder: Path) -> None:
    """Write the definitions that the peer reads, one file a message."""
    store = get_typestore(Stores.ROS2_JAZZY)
    for kind, _ in HEARD.values():
        text, _hash = store.generate_msgdef(kind, ros_version=2)
        first, *others = text.split("=" * 80 + "\n")
        named = {kind: first}
        for other in others:
            head, _, definition = other.partition("\n")
            named[head.removeprefix("MSG: ")] = definition
        for name, definition in named.items():
            package, *_, message = name.split("/")
            file = folder / package / "msg" / f"{message}.msg"
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(definition)


def main(host: str, port: str, folder: str, domain: str) -> None:
    """Hear one message of each topic."""
    write_definitions(Path(folder))
    session = ZenohSession.get_instance(host, int(port))
    get_registry().messages_dir = Path(folder)
    missing, changed = set(HEARD), threading.Condition()

    def tell(topic: str, message: Made) -> None:
        with changed:
            if topic in missing:
                print(json.dumps({"topic": topic, **HEARD[topic][1](message)}), flush=True)
                missing.discard(topic)
                changed.notify()

    subscribers = [
        zenoh_ros2_sdk.ROS2Subscriber(
            topic,
            kind,
            lambda message, topic=topic: tell(topic, message),
            domain_id=int(domain),
            router_ip=host,
            router_port=int(port),
        )
        for topic, (kind, _) in HEARD.items()
    ]
    with changed:
        changed.wait_for(lambda: not missing, PATIENCE)
    for subscriber in subscribers:
        subscriber.close()
    session.session.close()


if __name__ == "__main__":
    main(*sys.argv[1:])
