"""Builds versions in a thread of its own, so that receiving goes on meanwhile."""

import logging
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from types import TracebackType

from mapweave.config import Config
from mapweave.maps import JointMap
from mapweave.team.joining import JointParameters
from mapweave.team.joint_builder import JointMapBuilder, OvertakenError
from mapweave.team.joint_optimization import JointOptimizationParameters
from mapweave_fusion_server.draft import Draft
from mapweave_protocol.wire.codec import encode
from mapweave_protocol.wire.joint_message import JointPacker
from mapweave_protocol.wire.messages import JointMapMessage

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, eq=False)
class Built:
    """A version that is ready.

    Attributes
    ----------
    draft
        What it was made of.
    begun
        When that was all that was known [s since 1970].
    joint
        The joint map.
    message, payload
        What says it, and as it travels when it travels whole.
    has_more
        Whether submaps wait to be compared for the next version.
    """

    draft: Draft
    begun: float
    joint: JointMap
    message: JointMapMessage
    payload: bytes
    has_more: bool


class VersionBuilder:
    """Builds one draft at a time; a context manager that waits for the last one.

    Parameters
    ----------
    series
        Names the numbering, for the message.
    config
        The effective configuration.
    ready
        Called in the builder's thread when there is something to take.

    Attributes
    ----------
    series
        May be set while nothing is being built.
    has_failed
        Whether what was taken last could not be built, and was not just given up.
    """

    def __init__(
        self, series: str, config: Config, ready: Callable[[], object] = lambda: None
    ) -> None:
        self.series = series
        self.has_failed = False
        self._ready = ready
        # The worker's alone.
        self._builder = JointMapBuilder(
            JointParameters.of(config), JointOptimizationParameters.of(config)
        )
        self._packer = JointPacker()
        self._worker = ThreadPoolExecutor(1, thread_name_prefix="builder")
        self._future: Future[Built] | None = None

    def __enter__(self) -> "VersionBuilder":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._worker.shutdown(wait=True)

    @property
    def is_busy(self) -> bool:
        """Whether a draft was started and not yet taken."""
        return self._future is not None

    @property
    def is_ready(self) -> bool:
        """Whether `take` returns at once."""
        return self._future is not None and self._future.done()

    def start(
        self,
        draft: Draft,
        begun: float,
        *,
        patient: bool = False,
        is_awaited: bool = True,
        is_overtaken: Callable[[], bool] = lambda: False,
    ) -> None:
        """Start building `draft`, made of all that was known at `begun` [s since 1970].

        If it is `patient` nothing waits for the next version, however long this one takes. It is
        given up when it `is_overtaken`, asked in the builder's thread.
        """

        def build() -> JointMap:
            return draft.build(
                self._builder, patient=patient, is_awaited=is_awaited, is_overtaken=is_overtaken
            )

        self._future = self._worker.submit(self._build, draft, begun, build)
        self._future.add_done_callback(lambda _: self._ready())

    def take(self) -> Built | None:
        """Return the version that was started, when it is done; None when it could not be built.

        Unless it was overtaken, that is logged as the fault it is: a map nobody expected must not
        end the service, and the next change brings another try.
        """
        future, self._future = self._future, None
        if future is None:
            return None
        error = future.exception()
        self.has_failed = error is not None and not isinstance(error, OvertakenError)
        if isinstance(error, OvertakenError):
            return None
        if error is not None:
            _log.error("a version could not be built: %s", error, exc_info=error)
            return None
        return future.result()

    def in_series(self, built: Built) -> Built:
        """Return a version as one of the series that is set now."""
        message, payload = self._packed(built.joint)
        return replace(built, message=message, payload=payload)

    def _build(self, draft: Draft, begun: float, build: Callable[[], JointMap]) -> Built:
        joint = build()
        return Built(draft, begun, joint, *self._packed(joint), self._builder.has_more)

    def _packed(self, joint: JointMap) -> tuple[JointMapMessage, bytes]:
        message = JointMapMessage.pack(joint, self.series, self._packer)
        return message, encode(message)
