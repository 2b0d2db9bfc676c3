"""What watches over a coordinator asks it: ``/metrics``, ``/healthz``, ``/readyz``."""

from collections.abc import Iterator

from prometheus_client import CollectorRegistry, generate_latest
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.registry import Collector
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response
from starlette.routing import Route

from mapweave_fusion_server.web.feed import Feed, RobotReport, Seen
from mapweave_protocol.link.guard.refusals import Refusals

STALE = 10.0  # [s] without a word of the coordinator's loop, which speaks once a second
_TYPE = "text/plain; version=0.0.4; charset=utf-8"


def monitoring_routes(feed: Feed, refusals: Refusals) -> list[Route]:
    """Return what can be asked for, answered from what `feed` was handed.

    Parameters
    ----------
    refusals
        Of those who ask here; the feed has those of the wire.
    """
    registry = CollectorRegistry()
    registry.register(_TeamCollector(feed, refusals))

    async def metrics(_request: Request) -> Response:
        return Response(generate_latest(registry), media_type=_TYPE)

    async def health(_request: Request) -> Response:
        age = feed.age
        if age > STALE:
            return PlainTextResponse(f"no sign of the coordinator for {age:.0f} s\n", 503)
        return PlainTextResponse("alive\n")

    async def readiness(_request: Request) -> Response:
        missing = _missing(feed)
        return PlainTextResponse(f"{missing or 'ready'}\n", 503 if missing else 200)

    return [
        Route("/metrics", metrics),
        Route("/healthz", health),
        Route("/readyz", readiness),
    ]


def _missing(feed: Feed) -> str | None:
    """Return why the coordinator does not do all of its work, None where it does."""
    if feed.age > STALE:
        return "not coordinating yet, or no longer"
    if not feed.seen.coordinator.storing:
        return "versions are not stored: there is no room"
    return None


class _TeamCollector(Collector):
    """Turns what was seen last into metrics, when it is asked."""

    def __init__(self, feed: Feed, refusals: Refusals) -> None:
        self._feed = feed
        self._refusals = refusals

    def collect(self) -> Iterator[Metric]:
        """Yield all of them."""
        seen = self._feed.seen
        yield from _of_coordinator(seen, self._feed.age)
        yield from _of_robots(seen.robots)
        refused = CounterMetricFamily(
            "mapweave_refused",
            "Messages and requests that were refused.",
            labels=["sender", "kind"],
        )
        counts = {**seen.coordinator.refusals, **self._refusals.counts}
        for (sender, kind), count in counts.items():
            refused.add_metric([sender, kind], count)
        yield refused


def _of_coordinator(seen: Seen, age: float) -> Iterator[Metric]:
    said = seen.coordinator
    gauges = (
        ("version", "The latest version of the joint map.", seen.version),
        ("pending", "Whether something is in no version yet.", said.pending),
        ("storing", "Whether versions are stored.", said.storing),
        ("damaged_rows", "Rows of the store that could not be read.", said.damaged),
        ("coordinator_age_seconds", "Time since the coordinator's loop spoke.", age),
    )
    for name, text, value in gauges:
        yield GaugeMetricFamily(f"mapweave_{name}", text, value=float(value))
    yield CounterMetricFamily(
        "mapweave_dropped", "Messages that found no room.", value=float(said.dropped)
    )


def _of_robots(robots: tuple[RobotReport, ...]) -> Iterator[Metric]:
    families = {
        "alive": "Whether a run of the robot is here.",
        "scans_seen": "Scans of its run.",
        "scans_skipped": "Scans that came faster than they could be mapped.",
        "map_lag": "Versions of its map that have not come.",
    }
    metrics = {
        name: GaugeMetricFamily(f"mapweave_robot_{name}", text, labels=["robot"])
        for name, text in families.items()
    }
    for report in robots:
        values = {"alive": int(report.runs > 0)}
        if report.status is not None:
            values |= {
                "scans_seen": report.status.scans_seen,
                "scans_skipped": report.status.scans_skipped,
                "map_lag": max(0, report.status.map_version - (report.map_version or 0)),
            }
        for name, value in values.items():
            metrics[name].add_metric([report.robot], float(value))
    yield from metrics.values()
