#!/usr/bin/env bash
# rosbags 0.11.9: serialize_cdr copies the bytes of an array, whatever its type: ranges of a scan
# become other numbers.
#
# Expected: the typestore checks what it is given: a double, a list, a strided or a 2D array in
# place of `float32[]` raise, and a scalar of the wrong type does too. CDR carries its byte order in
# its header, so a writer is expected to swap where needed, and integers to be refused or converted.
#
# What happens: only the size of an element is compared. An array of float32 in big-endian order, as
# readers of FITS, SEG-Y, XTF and Java logs give it and as NumPy treats like any other (sums, plots
# and comparisons are right), is written as it lies in memory: 1.0 m is read back as 4.6e-41 m. So
# is int32 (millimetres, say): 1500 comes back as 2.1e-42. Every consumer sees nothing but returns
# below range_min. With `little_endian=False` it is the same.
#
# Seen:
#   float32, native:      [1.0, 2.0, 1500.0]
#   float32, big-endian:  [4.6e-41, 9e-44, 1.2e-38] though it equals the native one: True
#   int32:                [1.4e-45, 2.8e-45, 2.1e-42]
#   big-endian array and big-endian CDR: [4.6e-41, 9e-44, 1.2e-38]
#   float64: ValueError
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q --disable-pip-version-check --no-cache-dir \
    rosbags==0.11.9 numpy==2.4.6
"$work/venv/bin/python" - <<'EOF'
import sys

import numpy as np
from rosbags.typesys import Stores, get_typestore

store = get_typestore(Stores.ROS2_HUMBLE)
NAME = "sensor_msgs/msg/LaserScan"
Scan, Header, Time = (
    store.types[name] for name in (NAME, "std_msgs/msg/Header", "builtin_interfaces/msg/Time")
)


def round_trip(ranges, *, little_endian=True):
    scan = Scan(
        header=Header(stamp=Time(sec=1, nanosec=0), frame_id="laser"),
        angle_min=0.0,
        angle_max=1.0,
        angle_increment=0.5,
        time_increment=0.0,
        scan_time=0.1,
        range_min=0.1,
        range_max=30.0,
        ranges=ranges,
        intensities=np.zeros(0, np.float32),
    )
    data = store.serialize_cdr(scan, NAME, little_endian=little_endian)
    return store.deserialize_cdr(data, NAME).ranges


def brief(values):
    return [float(f"{value:.2g}") for value in values]


true = np.array([1, 2, 1500], np.float32)
swapped = true.astype(">f4")
native, big, whole = (round_trip(a) for a in (true, swapped, true.astype(np.int32)))
print(f"float32, native:      {brief(native)}")
equal = bool((swapped == true).all())
print(f"float32, big-endian:  {brief(big)} though it equals the native one: {equal}")
print(f"int32:                {brief(whole)}")
both = round_trip(swapped, little_endian=False)
print(f"big-endian array and big-endian CDR: {brief(both)}")
try:
    round_trip(true.astype(np.float64))
    refused = "nothing raised"
except ValueError:
    refused = "ValueError"
print(f"float64: {refused}")
tiny = max(abs(big).max(), abs(whole).max(), abs(both).max())
same = equal and (native == true).all() and 0 < tiny < 1e-30
sys.exit(0 if same and refused == "ValueError" else 1)
EOF
