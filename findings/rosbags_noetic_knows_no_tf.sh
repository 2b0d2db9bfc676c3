#!/usr/bin/env bash
# rosbags 0.11.9: the types of ROS 1 Noetic are without tf2_msgs/msg/TFMessage.
#
# Expected: `get_typestore(Stores.ROS1_NOETIC)` knows the messages that a bag of a robot holds, and
# nearly each of them has /tf. The stores of all ROS 2 distributions have the type, under the same
# name, and Noetic's has sensor_msgs/msg/LaserScan and nav_msgs/msg/Odometry beside it.
#
# What happens: it is missing in this store only. To deserialise a /tf of ROS 1 raises KeyError,
# unless the definition that the bag itself carries was registered first.
#
# Seen:
#   stores with LaserScan: 11, of these without TFMessage: ROS1_NOETIC
#   deserialise_ros1 of a TFMessage without transforms: KeyError 'tf2_msgs/msg/TFMessage'
#   after register_types: 0 transforms
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q --disable-pip-version-check --no-cache-dir \
    rosbags==0.11.9
"$work/venv/bin/python" - <<'EOF'
import sys

from rosbags.typesys import Stores, get_types_from_msg, get_typestore

TF = "tf2_msgs/msg/TFMessage"
stores = {store.name: get_typestore(store).types for store in Stores}
lasers = [name for name, types in stores.items() if "sensor_msgs/msg/LaserScan" in types]
without = [name for name in lasers if TF not in stores[name]]
print(f"stores with LaserScan: {len(lasers)}, of these without TFMessage: {', '.join(without)}")

noetic = get_typestore(Stores.ROS1_NOETIC)
empty = (0).to_bytes(4, "little")  # a sequence of no transforms
try:
    noetic.deserialize_ros1(empty, TF)
    raised = ""
except KeyError as error:
    raised = f"KeyError {error}"
print(f"deserialise_ros1 of a TFMessage without transforms: {raised}")
noetic.register(get_types_from_msg("geometry_msgs/TransformStamped[] transforms", TF))
count = len(noetic.deserialize_ros1(empty, TF).transforms)
print(f"after register_types: {count} transforms")
sys.exit(0 if without == ["ROS1_NOETIC"] and TF in raised and count == 0 else 1)
EOF
