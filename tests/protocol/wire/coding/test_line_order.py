"""Polylines travel in an order in which little is to be said of the way between them."""

import numpy as np

from mapweave.maps import LineMap
from mapweave_protocol.wire.coding.line_code import CodedLines


def test_each_polyline_begins_nearest_to_where_the_last_ended_of_all_that_are_left() -> None:
    rng = np.random.default_rng(5)
    starts = rng.uniform(-40.0, 40.0, (60, 2))
    segments = np.hstack([starts, starts + rng.uniform(-3.0, 3.0, (60, 2))])
    lines = LineMap(segments, np.arange(60), np.full(60, 9), ())
    sent = CodedLines.of(lines, 0, 100.0).segments
    assert len({tuple(one) for one in sent.tolist()}) == 60
    ends = np.vstack([[0, 0], sent[:-1, 2:]])
    for number, end in enumerate(ends):
        away = np.abs(sent[number:, :2] - end).sum(axis=1)
        assert away[0] == away.min()
