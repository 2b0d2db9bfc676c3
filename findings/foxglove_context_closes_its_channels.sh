#!/usr/bin/env bash
# foxglove-sdk 0.30.3: an open recording gets nothing once nobody holds its context.
#
# Expected: the writer that a function opened and the channel that it made keep alive what they
# need, as a file keeps its descriptor; what is logged on the channel is in the recording.
#
# What happens: both take `context=…`, and neither holds it. When the function that made all three
# returns the writer and the channel, the context is collected and its channels are closed. `log`
# raises nothing and returns nothing; one line goes to the log, and the recording, closed properly,
# is valid and empty. A live server made so tells its clients of no topic at all. Who keeps the
# context, or uses the global one, never sees it.
#
# Seen:
#   context kept     3 of 3 messages recorded
#   context dropped  0 of 3 messages recorded
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q --disable-pip-version-check --no-cache-dir \
    foxglove-sdk==0.30.3 mcap==1.6.0
"$work/venv/bin/python" - "$work" <<'EOF'
import sys
from pathlib import Path

from foxglove import Context, open_mcap
from foxglove.channels import LogChannel
from foxglove.messages import Log
from mcap.reader import make_reader

SAID = 3


def opened(path, kept):
    context = Context()
    kept.append(context)
    return open_mcap(path, context=context), LogChannel("/said", context=context)


def recorded(path, kept):
    writer, channel = opened(path, kept)
    del kept[1:]  # what is not to be held any more
    for number in range(SAID):
        channel.log(Log(message=f"scan {number}"))
    writer.close()
    with path.open("rb") as file:
        return len(list(make_reader(file).iter_messages()))


folder = Path(sys.argv[1])
kept = recorded(folder / "kept.mcap", [])
dropped = recorded(folder / "dropped.mcap", ["something else"])
print(f"context kept     {kept} of {SAID} messages recorded")
print(f"context dropped  {dropped} of {SAID} messages recorded")
sys.exit(0 if (kept, dropped) == (SAID, 0) else 1)
EOF
