#!/usr/bin/env bash
# zstandard 0.25.0 and lz4 4.4.5: of a compressed file that was written in two goes, some calls read
# all and some read the first half, and none says so.
#
# Expected: Zstandard's format defines that frames laid one after the other decompress to their
# contents joined, LZ4's frame format says the same; that is how a log is appended to, how `cat`
# joins two of them, and how parallel compressors write. Within one package one would think that all
# ways of decompressing agree.
#
# What happens: `decompress` of either package returns the first frame and drops the rest in
# silence, and so does zstandard's `read_to_iter`; `open`, `copy_stream` and lz4's `open` return
# all. zstandard's `stream_reader`, documented as reading one frame unless told otherwise, reads
# both. A scan log is simply shorter than it was, depending on which call a tool chose.
# backports.zstd (what Python 3.14 has built in) returns all of it.
#
# Seen:
#   two frames of 4000 bytes, 8000 in all
#   zstandard: decompress 4000, read_to_iter 4000, stream_reader 8000, copy_stream 8000, open 8000
#   lz4.frame: decompress 4000, open 8000
#   backports.zstd: decompress 8000
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q --disable-pip-version-check --no-cache-dir \
    zstandard==0.25.0 lz4==4.4.5 backports.zstd==1.8.0
"$work/venv/bin/python" - <<'EOF'
import io
import sys

import lz4.frame
import zstandard
from backports import zstd

FIRST, SECOND = b"scan" * 1000, b"more" * 1000
compressor = zstandard.ZstdCompressor()
both = compressor.compress(FIRST) + compressor.compress(SECOND)
lz4_both = lz4.frame.compress(FIRST) + lz4.frame.compress(SECOND)
reader = zstandard.ZstdDecompressor()
copied = io.BytesIO()
reader.copy_stream(io.BytesIO(both), copied)
lengths = {
    "decompress": len(reader.decompress(both)),
    "read_to_iter": sum(map(len, reader.read_to_iter(both))),
    "stream_reader": len(reader.stream_reader(both).read()),
    "copy_stream": len(copied.getvalue()),
    "open": len(zstandard.open(io.BytesIO(both)).read()),
}
lz4_lengths = {
    "decompress": len(lz4.frame.decompress(lz4_both)),
    "open": len(lz4.frame.open(io.BytesIO(lz4_both)).read()),
}
print(f"two frames of {len(FIRST)} bytes, {len(FIRST + SECOND)} in all")


def listed(found):
    return ", ".join(f"{name} {length}" for name, length in found.items())


print(f"zstandard: {listed(lengths)}")
print(f"lz4.frame: {listed(lz4_lengths)}")
built_in = len(zstd.decompress(both))
print(f"backports.zstd: decompress {built_in}")
short = lengths["decompress"], lengths["read_to_iter"], lz4_lengths["decompress"]
full = lengths["copy_stream"], lengths["open"], lz4_lengths["open"], built_in
sys.exit(0 if set(short) == {4000} and set(full) == {8000} else 1)
EOF
