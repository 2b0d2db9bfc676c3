"""The live page: what a large map costs in a real Chromium, and whether memory stays flat.

It ends with 1 where a bar is not held.
"""

import argparse
import gc
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import median
from typing import TypeAlias

import numpy as np
from playwright.sync_api import CDPSession, Page

from benchmarks.tables import OUTPUT, format_table, write_json
from mapweave.config import Config
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import JointComponent, JointMap, LineMap, RobotMap, Submap, Trajectory
from mapweave_fusion_server.store import Store
from mapweave_fusion_server.web.address import HttpAddress
from mapweave_fusion_server.web.feed import CoordinatorReport, Feed, RobotReport
from mapweave_fusion_server.web.server import live_page
from mapweave_protocol.wire.codec import encode
from mapweave_protocol.wire.messages import JointMapMessage
from tests.fusion_server.web.browser import chromium, visit

ROBOTS, SCANS, RATE = 20, 400, 10.0  # scans of each, and reports a second
PAN_STEPS, SHOWN = 200, 12  # and versions of each kind that are timed
PAUSE = 500  # [ms] between two of them: a coordinator makes one a second at the most
ROOM = 4.0  # [m]
OPENED, SCRIPT = "map painted after opening [ms]", "script a frame while panning [ms]"
DELAY = "publication to paint, {}, median [ms]"
WATCH = """
window.painted = {}; window.frames = 0;
const ask = window.requestAnimationFrame.bind(window);
window.requestAnimationFrame = (work) => ask((now) => { window.frames += 1; work(now); });
new MutationObserver(() => {
  const version = document.getElementById('map')?.dataset.version;
  if (version && !(version in window.painted)) {
    window.painted[version] = 0;
    ask(() => setTimeout(() => {
      window.painted[version] = performance.timeOrigin + performance.now();
    }));
  }
}).observe(document, { subtree: true, childList: true, attributes: true });
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Say how large the map is and how many versions are fed."""
    parser.add_argument("--segments", type=int, default=5000, metavar="N", help="walls (5000)")
    parser.add_argument("--versions", type=int, default=600, metavar="N", help="fed (600)")


@dataclass(frozen=True)
class Bench:
    """A page that is served, and a tab that looks at it."""

    store: Store
    feed: Feed
    tab: Page
    cdp: CDPSession
    joint: JointMap
    maps: tuple[RobotMap, ...]

    def publish(self, changed: "Change | None" = None) -> float:
        """Publish a version; return when it was handed over [s since 1970]."""
        version = self.store.latest_version + 1
        joint, maps = (self.joint, self.maps) if changed is None else changed(self, version)
        joint = replace(joint, version=version)
        message = JointMapMessage.pack(joint, self.store.series)
        self.store.add_version(version, time.time(), encode(message))
        handed = time.time()
        self.feed.show_version(version, maps, message)
        return handed

    def painted(self, version: int) -> float:
        """Return when a version was painted [s since 1970]."""
        while not (at := self.tab.evaluate(f"window.painted['{version}'] || 0")):
            self.tab.wait_for_timeout(20)
        return float(at) / 1000

    def metric(self, name: str) -> float:
        """Return one of the browser's own figures."""
        metrics = self.cdp.send("Performance.getMetrics")["metrics"]
        return float(next(m["value"] for m in metrics if m["name"] == name))

    def memory(self) -> tuple[float, float]:
        """Return what page and server hold [MB], what nobody holds any more left out."""
        self.cdp.send("HeapProfiler.collectGarbage")
        gc.collect()
        statm = Path("/proc/self/statm").read_text().split()
        return self.metric("JSHeapUsedSize") / 1e6, int(statm[1]) * 4096 / 1e6


def run(options: argparse.Namespace) -> None:
    """Measure, print, write."""
    lines, places = _rooms(options.segments)
    robots = {f"r{k}/0": place for k, place in enumerate(places[:ROBOTS])}
    component = JointComponent(robots, 0.9, lines, np.ones(len(lines.segments)))
    joint, maps = JointMap(1, (component,), ()), tuple(_driven(k, lines) for k in range(ROBOTS))
    with _opened(joint, maps) as bench:
        rows = {**_measure(bench), **_feed(bench, options.versions)}
    print(format_table(["", "", "bar", "ratio"], [_row(*row) for row in rows.items()]))
    write_json(OUTPUT / "page.json", {"segments": len(lines.segments), **rows})
    if short := [name for name, figure in rows.items() if figure > BARS.get(name, figure)]:
        raise SystemExit(f"over its bar: {'; '.join(short)}")


def _row(name: str, figure: float) -> list[str]:
    bar = BARS.get(name)
    told = ["", ""] if bar is None else [f"{bar:.0f}", f"{figure / bar:.2f}"]
    return [name, f"{figure:.1f}", *told]


@contextmanager
def _opened(joint: JointMap, maps: tuple[RobotMap, ...]) -> Iterator[Bench]:
    feed, anywhere = Feed(), HttpAddress("127.0.0.1", 0)
    with (
        tempfile.TemporaryDirectory() as folder,
        Store(Path(folder, "store.sqlite"), "team") as store,
        live_page(anywhere, "team", store, Config(), feed, "token") as address,
        chromium() as browser,
        visit(browser, "about:blank") as seen,
    ):
        cdp = seen.tab.context.new_cdp_session(seen.tab)
        cdp.send("Performance.enable")
        bench = Bench(store, feed, seen.tab, cdp, joint, maps)
        bench.publish()
        seen.tab.add_init_script(WATCH)
        seen.tab.goto(address.url())
        bench.painted(1)
        gc.freeze()  # as the coordinator does
        yield bench


def _measure(bench: Bench) -> dict[str, float]:
    """Return what opening, following and panning costs, in milliseconds."""
    opened = bench.painted(1) * 1000 - float(bench.tab.evaluate("performance.timeOrigin"))
    delays: dict[str, float] = {}
    for name, change in CHANGES.items():
        taken = [_delay(bench, change) for _ in range(SHOWN)]
        delays[DELAY.format(name)] = median(taken)
        delays[f"publication to paint, {name}, longest [ms]"] = max(taken)
    script, frames = _pan(bench)
    return {
        OPENED: opened,
        **delays,
        SCRIPT: 1000 * script / frames,
        "frames drawn": frames,
    }


def _delay(bench: Bench, change: "Change | None") -> float:
    """Return how long after it was handed over a version is painted [ms]."""
    bench.tab.wait_for_timeout(PAUSE)
    handed = bench.publish(change)
    return 1000 * (bench.painted(bench.store.latest_version) - handed)


def _a_little(bench: Bench, version: int) -> tuple[JointMap, tuple[RobotMap, ...]]:
    """Return a version in which a room was moved by a centimetre, and a robot drove on."""
    (component,) = bench.joint.components
    segments = component.map.segments.copy()
    room = 4 * (version % (len(segments) // 4))
    segments[room : room + 4] += 0.01
    lines = replace(component.map, segments=segments)
    joint = replace(bench.joint, components=(replace(component, map=lines),))
    robot = version % len(bench.maps)
    grown = replace(bench.maps[robot], version=version)
    return joint, (*bench.maps[:robot], grown, *bench.maps[robot + 1 :])


def _all_of_it(bench: Bench, version: int) -> tuple[JointMap, tuple[RobotMap, ...]]:
    """Return a version in which every wall and every path moved, as when a loop is closed."""
    (component,) = bench.joint.components
    lines = component.map.moved(np.array([0.01 * (version % 7), 0.0, 0.0]))
    joint = replace(bench.joint, components=(replace(component, map=lines),))
    return joint, tuple(replace(each, version=version) for each in bench.maps)


Change: TypeAlias = Callable[[Bench, int], tuple[JointMap, tuple[RobotMap, ...]]]
CHANGES: dict[str, Change | None] = {
    "nothing changed": None,
    "a room and a robot": _a_little,
    "everything": _all_of_it,
}


BARS = {OPENED: 1000.0, SCRIPT: 16.0, **{DELAY.format(name): 100.0 for name in CHANGES}}


def _pan(bench: Bench) -> tuple[float, int]:
    """Pan while robots are reported; return the script's time [s] and the frames drawn."""
    ended = threading.Event()
    reporter = threading.Thread(target=_report, args=(bench.feed, ended))
    reporter.start()
    before, drawn = bench.metric("ScriptDuration"), bench.tab.evaluate("window.frames")
    bench.tab.mouse.move(500, 400)
    bench.tab.mouse.down()
    for k in range(PAN_STEPS):
        bench.tab.mouse.move(500 + 150 * np.sin(k / 9), 400 + 100 * np.cos(k / 7))
    bench.tab.mouse.up()
    after, frames = bench.metric("ScriptDuration"), bench.tab.evaluate("window.frames")
    ended.set()
    reporter.join()
    return after - before, int(frames) - int(drawn)


def _report(feed: Feed, ended: threading.Event) -> None:
    while not ended.wait(1 / RATE):
        now = time.time()
        reports = tuple(RobotReport(f"r{k}", 1, None, now, 1) for k in range(ROBOTS))
        feed.show_team(reports, CoordinatorReport(stamp=now))


def _feed(bench: Bench, versions: int) -> dict[str, float]:
    """Return what page and server hold [MB] after a third of many versions, and after all."""
    held: list[tuple[float, float]] = []
    for fed in range(versions):
        bench.publish(_a_little)
        bench.tab.wait_for_timeout(1)
        if fed in (versions // 3, versions - 1):
            bench.painted(bench.store.latest_version)
            held.append(bench.memory())
    (page, server), (page_then, server_then) = held
    return {
        f"page after {versions // 3} versions [MB]": page,
        f"page after {versions} versions [MB]": page_then,
        f"server after {versions // 3} versions [MB]": server,
        f"server after {versions} versions [MB]": server_then,
    }


def _rooms(segments: int) -> tuple[LineMap, list[FloatArray]]:
    """Return square rooms side by side, and the middle of each."""
    count = segments // 4
    side = int(np.ceil(np.sqrt(count)))
    corner = ROOM * np.array([[k % side, k // side] for k in range(count)], dtype=float)
    square = (ROOM - 0.2) * np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    rings = corner[:, None] + square
    walls = np.concatenate([rings, np.roll(rings, -1, axis=1)], axis=2).reshape(-1, 4)
    polyline = np.repeat(np.arange(count), 4)
    support = 1 + np.arange(len(walls)) % 40
    return LineMap(walls, polyline, support, tuple(rings)), [np.array([*c, 0.0]) for c in corner]


def _driven(number: int, lines: LineMap) -> RobotMap:
    """Return the map of a robot that drove in circles through the first rooms."""
    turn = np.linspace(0, 20, SCANS)
    pose = np.column_stack([turn * np.cos(turn), turn * np.sin(turn), turn])
    trajectory = Trajectory(np.arange(SCANS), turn, se2.compose(se2.IDENTITY, pose))
    few = LineMap(lines.segments[:40], lines.polyline[:40], lines.support[:40])
    return RobotMap(f"r{number}", "first", 1, (Submap(0, 0, np.zeros(3), few, trajectory),))
