"""Versions are built in a thread of their own, as the configuration says."""

import threading
import time
from collections.abc import Callable

import pytest

from mapweave.config import Config, Mapping
from mapweave.maps import JointMap
from mapweave.team.joining import JointParameters
from mapweave.team.joint_builder import JointMapBuilder
from mapweave_fusion_server.builder import VersionBuilder
from mapweave_fusion_server.draft import Draft

GIVEN: list[JointParameters] = []


class Noting(Draft):
    """A draft that notes what it is built with."""

    def build(
        self,
        builder: JointMapBuilder,
        *,
        patient: bool = False,
        is_awaited: bool = True,
        is_overtaken: Callable[[], bool] = lambda: False,
    ) -> JointMap:
        """Return a map of nothing."""
        assert not patient
        assert is_awaited
        assert not is_overtaken()
        GIVEN.append(builder.parameters)
        return JointMap(self.version, (), ())


def test_a_version_is_built_with_what_the_configuration_says() -> None:
    config = Config(mapping=Mapping(max_gap=0.7))
    with VersionBuilder("series", config) as builder:
        builder.start(Noting(1, (), ()), time.time())
        built = builder.take()
    assert built is not None
    assert built.joint.version == 1
    assert [JointParameters.of(config)] == GIVEN


def test_a_version_that_is_ready_is_told_of_at_once() -> None:
    told = threading.Event()
    with VersionBuilder("series", Config(), told.set) as builder:
        builder.start(Draft(1, (), ()), time.time())
        assert told.wait(60.0)
        assert builder.is_ready


def test_a_version_that_was_overtaken_is_given_up_and_that_is_no_fault(
    caplog: pytest.LogCaptureFixture,
) -> None:
    with VersionBuilder("series", Config()) as builder:
        builder.start(Draft(1, (), ()), time.time(), is_overtaken=lambda: True)
        assert builder.take() is None
        builder.start(Draft(1, (), ()), time.time(), is_overtaken=lambda: False)
        assert builder.take() is not None
    assert not caplog.records


def test_a_version_that_cannot_be_built_is_logged_and_told_apart_from_one_that_was_given_up(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def fail(*_: object, **__: object) -> None:
        raise ZeroDivisionError

    with VersionBuilder("series", Config()) as builder:
        with monkeypatch.context() as broken:
            broken.setattr(JointMapBuilder, "build", fail)
            builder.start(Draft(1, (), ()), time.time())
            assert builder.take() is None
        assert builder.has_failed
        assert "a version could not be built" in caplog.text
        builder.start(Draft(1, (), ()), time.time(), is_overtaken=lambda: True)
        assert builder.take() is None
        assert not builder.has_failed


def test_a_version_says_whether_submaps_wait_for_the_next_one(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    with VersionBuilder("series", Config()) as builder:
        for waits in (True, False):
            monkeypatch.setattr(JointMapBuilder, "has_more", waits)
            builder.start(Draft(1, (), ()), time.time())
            built = builder.take()
            assert built is not None
            assert built.has_more is waits
