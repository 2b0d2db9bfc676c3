"""Topics of which nothing is heard are told of, each on its own."""

import pytest

from mapweave_ros.silence import Expected, Silence

SCAN, SILENT = "sensor_msgs/msg/LaserScan", 5.0


@pytest.fixture(autouse=True)
def _silent(_patient: None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("mapweave_ros.silence.SILENT", SILENT)


class Watched:
    """A watch over topics, its clock in the hands of the test."""

    def __init__(self, *lasers: str, there: list[tuple[int, str]] | None = None) -> None:
        self.now = 100.0
        self.told: list[str] = []
        self.watch = Silence(
            {laser: Expected("scan", SCAN) for laser in lasers},
            2,
            lambda kind: (there or []) if kind == SCAN else [],
            self.told.append,
            self.told.append,
            lambda: self.now,
        )

    def wait(self, seconds: float, *heard: str) -> list[str]:
        """Let time pass, in which `heard` are heard again and again; return what is told."""
        before = len(self.told)
        for _ in range(round(10 * seconds)):
            self.now += 0.1
            for topic in heard:
                self.watch.heard(topic)
            self.watch.check()
        return self.told[before:]


def test_a_topic_that_is_heard_is_not_told_of() -> None:
    assert Watched("/scan").wait(10 * SILENT, "/scan") == []


def test_a_silent_topic_is_told_of_once_and_when_it_is_heard() -> None:
    watched = Watched("/scan")
    assert watched.wait(SILENT - 0.5) == []
    (line,) = watched.wait(10 * SILENT)
    assert line.startswith("no scan yet at /scan in domain 2; of topics with LaserScan none is")
    assert watched.wait(SILENT, "/scan") == ["/scan is heard now"]


def test_a_laser_that_falls_silent_is_told_of_each_time() -> None:
    watched = Watched("/scan")
    for _ in range(2):
        watched.wait(1.0, "/scan")
        (line,) = watched.wait(2 * SILENT)
        assert line.startswith("no scan for 5 s at /scan in domain 2")


def test_of_two_lasers_the_one_that_is_silent_is_told_of() -> None:
    (line,) = Watched("/front", "/rear").wait(3 * SILENT, "/front")
    assert "at /rear in" in line


@pytest.mark.parametrize(
    ("there", "named"),
    [
        ([(1, "/other"), (2, "/back"), (2, "/front")], "/back, /front"),
        ([(0, "/scan"), (7, "/scan")], "/scan in domain 0, /scan in domain 7"),
    ],
)
def test_topics_of_this_domain_are_named_or_else_those_of_others(
    there: list[tuple[int, str]], named: str
) -> None:
    (line,) = Watched("/scan", there=there).wait(2 * SILENT)
    assert line.endswith(f"of topics with LaserScan those announced are {named}")
