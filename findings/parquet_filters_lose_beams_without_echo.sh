#!/usr/bin/env bash
# pyarrow 26.0.1, duckdb 2.0.1, datafusion 55.0.0: of scans in Parquet beams without an echo get lost.
#
# Expected: ROS marks a beam that measured nothing by NaN. A table of scans with such beams is written
# to Parquet, and a filter is to give them back: those where the range is NaN, or those for which
# "at most 30 m" is not true. The same filter of the same table in memory gives all of them.
#
# What happens: of each group of rows the file tells the least and the largest value. NaN is left out of
# both, as the format asks for, and the format goes on that these two say nothing about whether there is
# a NaN. Three readers conclude from them all the same that each range of a group lies between 1 and
# 10 m, so that "not at most 30 m" can be true of none: the group is skipped unread, and no beam comes.
# DuckDB skips it for "is NaN" too. A group of nothing but NaN tells no such values and is read, so
# the answer depends on how many rows a group has. Nothing is raised. Polars reads the same file
# right, and all of them do where it was written with `write_statistics=False`.
#
# Seen (720 beams, 72 of them NaN; how many are found in memory, in a file, in one without statistics):
#   pyarrow      is NaN             in memory 72, in a file 72, without statistics 72
#   pyarrow      not at most 30 m   in memory 72, in a file  0, without statistics 72
#   duckdb       is NaN             in memory 72, in a file  0, without statistics 72
#   duckdb       not at most 30 m   in memory 72, in a file  0, without statistics 72
#   datafusion   is NaN             in memory 72, in a file 72, without statistics 72
#   datafusion   not at most 30 m   in memory 72, in a file  0, without statistics 72
#   polars       is NaN             in memory 72, in a file 72, without statistics 72
#   polars       not at most 30 m   in memory 72, in a file 72, without statistics 72
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q --disable-pip-version-check --no-cache-dir \
    pyarrow==26.0.1 duckdb==2.0.1 datafusion==55.0.0 polars==2.1.0 numpy==2.4.6
"$work/venv/bin/python" - "$work" <<'EOF'
import sys
from pathlib import Path

import datafusion
import duckdb
import numpy as np
import polars
import pyarrow
import pyarrow.compute as pc
import pyarrow.parquet as pq

BEAMS, MISSING = 720, 72
RANGES = np.random.default_rng(1).uniform(1, 10, BEAMS)
RANGES[:: BEAMS // MISSING] = np.nan
SCANS = pyarrow.table({"beam": np.arange(BEAMS), "range": RANGES})
PATHS = [Path(sys.argv[1]) / name for name in ("scans.parquet", "without.parquet")]
ARROW = {"is NaN": pc.is_nan(pc.field("range")), "not at most 30 m": ~(pc.field("range") <= 30)}
SQL = {"is NaN": "isnan(range)", "not at most 30 m": "not (range <= 30)"}
POLARS = {
    "is NaN": polars.col("range").is_nan(),
    "not at most 30 m": ~(polars.col("range") <= 30),
}


def by_pyarrow(name):
    yield SCANS.filter(ARROW[name]).num_rows
    for path in PATHS:
        yield pq.read_table(path, filters=ARROW[name]).num_rows


def by_duckdb(name):
    with duckdb.connect() as database:
        database.register("scans", SCANS)
        for source in ("scans", *(f"'{path}'" for path in PATHS)):
            count = database.execute(f"select count(*) from {source} where {SQL[name]}")
            yield count.fetchone()[0]


def by_datafusion(name):
    context = datafusion.SessionContext()
    context.register_record_batches("memory", [SCANS.to_batches()])
    for path in PATHS:
        context.register_parquet(path.stem, str(path))
    for source in ("memory", *(path.stem for path in PATHS)):
        yield context.sql(f"select beam from {source} where {SQL[name]}").count()


def by_polars(name):
    yield polars.from_arrow(SCANS).filter(POLARS[name]).height
    for path in PATHS:
        yield polars.scan_parquet(path).filter(POLARS[name]).collect().height


for path, statistics in zip(PATHS, (True, False), strict=True):
    pq.write_table(SCANS, path, write_statistics=statistics)
same = True
for reader in (by_pyarrow, by_duckdb, by_datafusion, by_polars):
    for name in SQL:
        memory, file, without = reader(name)
        told = f"{reader.__name__[3:]:12} {name:18} in memory {memory}, in a file {file:2}"
        print(f"{told}, without statistics {without}")
        skipped = reader is by_duckdb or (reader is not by_polars and name == "not at most 30 m")
        same &= (memory, file, without) == (MISSING, 0 if skipped else MISSING, MISSING)
sys.exit(0 if same else 1)
EOF
