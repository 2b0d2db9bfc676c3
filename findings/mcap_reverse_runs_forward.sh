#!/usr/bin/env bash
# mcap 1.6.0: read in reverse, a file without chunks comes from its beginning on.
#
# Expected: `iter_messages(reverse=True)` promises descending log times: the way to the last map, or to
# what a robot saw before it stopped. Files without chunks are what ROS 2's recorder writes by its
# preset `fastwrite`, for robots that have nothing to spare.
#
# What happens: where the summary lists no chunks, the reader of files hands over to that of streams.
# That one can run backwards too, and is told of topics, times and order, but not of `reverse`. The
# messages come in ascending order, and "the last map" is the first of the drive, sound in itself.
# Nothing is raised. Files whose chunks are not indexed are read so as well. Asked directly, the reader
# of streams gives the same bytes in reverse.
#
# Seen (five messages, logged at 1 to 5 s):
#   in chunks                    [5, 4, 3, 2, 1]
#   without chunks               [1, 2, 3, 4, 5]
#   without chunk index          [1, 2, 3, 4, 5]
#   without chunks, as a stream  [5, 4, 3, 2, 1]
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q --disable-pip-version-check --no-cache-dir mcap==1.6.0
"$work/venv/bin/python" - <<'EOF'
import sys
from io import BytesIO

from mcap.reader import NonSeekingReader, make_reader
from mcap.writer import IndexType, Writer

SECOND = 10**9


def recording(**options):
    stream = BytesIO()
    writer = Writer(stream, **options)
    writer.start()
    channel = writer.register_channel("/map", "json", 0)
    for stamp in range(1, 6):
        writer.add_message(channel, stamp * SECOND, b"{}", stamp * SECOND)
    writer.finish()
    stream.seek(0)
    return stream


def backwards(reader):
    found = reader.iter_messages(log_time_order=True, reverse=True)
    return [message.log_time // SECOND for _, _, message in found]


plain = {"use_chunking": False}
seen = {
    "in chunks": backwards(make_reader(recording())),
    "without chunks": backwards(make_reader(recording(**plain))),
    "without chunk index": backwards(
        make_reader(recording(index_types=IndexType.ALL & ~IndexType.CHUNK))
    ),
    "without chunks, as a stream": backwards(NonSeekingReader(recording(**plain))),
}
for name, stamps in seen.items():
    print(f"{name:28} {stamps}")
down, up = [5, 4, 3, 2, 1], [1, 2, 3, 4, 5]
sys.exit(0 if list(seen.values()) == [down, up, up, down] else 1)
EOF
