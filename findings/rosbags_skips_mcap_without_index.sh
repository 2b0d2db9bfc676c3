#!/usr/bin/env bash
# rosbags 0.11.9: of an MCAP whose chunks have no message index it tells all messages and reads none.
#
# Expected: in MCAP an index is optional. For each chunk the summary lists where the index of each of
# its channels is, and of an empty list the format says that no index is available: nothing about
# what the chunk holds, so it is to be opened. ROS 2's recorder writes such files where its storage
# configuration says `noMessageIndex: true`, and the format's own writers by an option.
#
# What happens: an empty list is taken for a chunk without messages of the topics asked for, and every
# chunk is passed over. The count of messages, the duration and what each topic holds are taken from
# the statistics and right, so all that is printed of the bag looks sound; the loop over its messages
# ends at once, and nothing is raised or logged. In a run over many bags one map is empty. The format's
# own reader gets all of it, and so does rosbags where chunks are not listed, or where there are none.
#
# Seen (ten scans, told by rosbags, read by it, and read by mcap):
#   with all indexes       told 10, read 10, by mcap 10
#   without message index  told 10, read  0, by mcap 10
#   without chunk index    told 10, read 10, by mcap 10
#   without chunks         told 10, read 10, by mcap 10
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q --disable-pip-version-check --no-cache-dir \
    rosbags==0.11.9 mcap==1.6.0 numpy==2.4.6
"$work/venv/bin/python" - "$work/scans.mcap" <<'EOF'
import sys
from pathlib import Path

import numpy as np
from mcap.reader import make_reader
from mcap.writer import IndexType, Writer
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

PATH, COUNT, KIND = Path(sys.argv[1]), 10, "sensor_msgs/msg/LaserScan"
STORE = get_typestore(Stores.ROS2_HUMBLE)
RANGES = np.full(5, 4.0, np.float32)
WAYS = {
    "with all indexes": {},
    "without message index": {"index_types": IndexType.ALL & ~IndexType.MESSAGE},
    "without chunk index": {"index_types": IndexType.ALL & ~IndexType.CHUNK},
    "without chunks": {"use_chunking": False},
}


def scan(number):
    time = STORE.types["builtin_interfaces/msg/Time"](sec=number, nanosec=0)
    header = STORE.types["std_msgs/msg/Header"](stamp=time, frame_id="laser")
    message = STORE.types[KIND](header, -1.0, 1.0, 0.5, 0.0, 0.1, 0.1, 30.0, RANGES, RANGES[:0])
    return bytes(STORE.serialize_cdr(message, KIND))


def write(**options):
    definition, _ = STORE.generate_msgdef(KIND, ros_version=2)
    with PATH.open("wb") as file:
        writer = Writer(file, **options)
        writer.start(profile="ros2")
        schema = writer.register_schema(KIND, "ros2msg", definition.encode())
        channel = writer.register_channel("/scan", "cdr", schema)
        for number in range(COUNT):
            stamp = (number + 1) * 10**9
            writer.add_message(channel, stamp, scan(number), stamp)
        writer.finish()


seen = {}
for name, options in WAYS.items():
    write(**options)
    with AnyReader([PATH]) as reader:
        told, read = reader.message_count, sum(1 for _ in reader.messages())
    with PATH.open("rb") as file:
        own = sum(1 for _ in make_reader(file).iter_messages())
    seen[name] = told, read, own
    print(f"{name:22} told {told}, read {read:2}, by mcap {own}")
lost = seen.pop("without message index")
same = lost == (COUNT, 0, COUNT) and all(way == (COUNT,) * 3 for way in seen.values())
sys.exit(0 if same else 1)
EOF
