#!/usr/bin/env bash
# zstandard 0.25.0: a message compressed with one dictionary and decompressed with another comes
# back with the right length, without an error, and with other contents.
#
# Expected: small messages of a robot are compressed with a dictionary made of an earlier message.
# A frame names its dictionary by an id, so that a decoder that holds another one can tell; with a
# wrong one it should refuse, as it does with none ("Data corruption detected").
#
# What happens: only trained dictionaries have an id. Raw content (any bytes; what one has at hand
# when both sides know an earlier message) has none, in the format as well as here, and a
# back-reference into it fetches whatever lies at that offset. Two versions of the same message make
# that easy: the length is the same and most bytes agree, so a decoder after it may well accept it.
# The frame's checksum, which would find it, is off by default in this package although the `zstd`
# command switches it on.
#
# Seen:
#   right dictionary: equal True
#   wrong dictionary: 400 bytes of 400, no error, equal False; 12 of 100 ranges differ
#   no dictionary: ZstdError
#   wrong dictionary, write_checksum=True: ZstdError
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q --disable-pip-version-check --no-cache-dir \
    zstandard==0.25.0 numpy==2.4.6
"$work/venv/bin/python" - <<'EOF'
import sys

import numpy as np
import zstandard

rng = np.random.default_rng(0)
yesterday = rng.uniform(0.1, 30, 100).astype(np.float32)
today = yesterday.copy()
today[40:52] += 0.5  # a door has opened
message = yesterday.tobytes()


def dictionary(ranges):
    return zstandard.ZstdCompressionDict(
        ranges.tobytes(), dict_type=zstandard.DICT_TYPE_RAWCONTENT
    )


def opened(frame, known):
    try:
        return zstandard.ZstdDecompressor(dict_data=known).decompress(frame)
    except zstandard.ZstdError:
        return None


frame, summed = (
    zstandard.ZstdCompressor(dict_data=dictionary(yesterday), write_checksum=checksum).compress(
        message
    )
    for checksum in (False, True)
)
right = opened(frame, dictionary(yesterday))
wrong = opened(frame, dictionary(today))
print(f"right dictionary: equal {right == message}")
if wrong is None:
    sys.exit("wrong dictionary: an error")
differ = int((np.frombuffer(wrong, np.float32) != yesterday).sum())
print(
    f"wrong dictionary: {len(wrong)} bytes of {len(message)}, no error, equal {wrong == message}; "
    f"{differ} of {len(yesterday)} ranges differ"
)
none, checked = opened(frame, None), opened(summed, dictionary(today))
print(f"no dictionary: {'ZstdError' if none is None else 'no error'}")
print(f"wrong dictionary, write_checksum=True: {'ZstdError' if checked is None else 'no error'}")
same = right == message and len(wrong) == len(message) and differ > 0
sys.exit(0 if same and none is None and checked is None else 1)
EOF
