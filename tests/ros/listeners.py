"""What a ROS 2 node hears: messages decoded by the definitions of another release."""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import zenoh
import zenoh.ext as ze
from rosbags.typesys import Stores, get_typestore

STORE = get_typestore(Stores.ROS2_HUMBLE)
NEVER = 60.0  # [s]


class Listener:
    """Keeps what is said at a topic, as a late transient-local subscription does."""

    def __init__(self, kind: str) -> None:
        self.messages: list[Any] = []
        self.attachments: list[bytes] = []
        self._kind = kind
        self._changed = threading.Condition()

    def take(self, sample: zenoh.Sample) -> None:
        """Take a message."""
        with self._changed:
            self.messages.append(STORE.deserialize_cdr(sample.payload.to_bytes(), self._kind))
            attached = sample.attachment
            self.attachments.append(b"" if attached is None else attached.to_bytes())
            self._changed.notify_all()

    def wait(self, count: int) -> Any:  # noqa: ANN401
        """Return the `count`-th message, past or to come."""
        with self._changed:
            heard = self._changed.wait_for(lambda: len(self.messages) >= count, NEVER)
            assert heard, f"{len(self.messages)} messages; expected {count}"
            return self.messages[count - 1]

    def until(self, condition: Callable[[Any], bool]) -> Any:  # noqa: ANN401
        """Return the first message, past or to come, that fulfils `condition`."""
        with self._changed:
            found = self._changed.wait_for(
                lambda: next(filter(condition, self.messages), None), NEVER
            )
            assert found is not None, f"{len(self.messages)} messages, none as expected"
            return found


@contextmanager
def listening(
    session: zenoh.Session, domain: int, topic: str, kind: str, type_hash: str | None = None
) -> Iterator[Listener]:
    """Listen at a topic for the length of a block."""
    package, _, name = kind.split("/")
    named = f"{package}::msg::dds_::{name}_/{type_hash or STORE.hash_rihs01(kind)}"
    listener = Listener(kind)
    with ze.declare_advanced_subscriber(
        session,
        f"{domain}{topic}/{named}",
        listener.take,
        history=ze.HistoryConfig(max_samples=1, detect_late_publishers=True),
    ):
        yield listener
