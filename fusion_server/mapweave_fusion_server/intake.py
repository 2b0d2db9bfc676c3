"""From what arrives to the coordinator and the store: checked, remembered, told.

Whatever arrives, nothing but `FileError` leaves here: what is no proper message is logged, counted
and dropped. Knows no clock.
"""

import logging
from typing import TypeVar

from mapweave.maps import JointMap, RobotMap
from mapweave_fusion_server.coordinator import Coordinator
from mapweave_fusion_server.early import EarlyAlignment, EarlyAlignments
from mapweave_fusion_server.journal import Bounded, record
from mapweave_fusion_server.store import Store
from mapweave_fusion_server.web.feed import RobotReport
from mapweave_protocol.errors import MessageError
from mapweave_protocol.link.assembler import MapAssembler
from mapweave_protocol.link.guard.refusals import Refusals
from mapweave_protocol.link.guard.strangers import Strangers
from mapweave_protocol.link.inbox import (
    Arrival,
    alignment_reader,
    held_orders_reader,
    map_reader,
    marks_reader,
    order_reader,
    read_coordinator,
    read_presence,
    status_reader,
)
from mapweave_protocol.link.lacking import Lacking
from mapweave_protocol.link.security.proof import Check, unchecked
from mapweave_protocol.narration.attendance import Attendance
from mapweave_protocol.narration.story import Story
from mapweave_protocol.wire.codec import decode, encode
from mapweave_protocol.wire.messages import (
    AlignmentMessage,
    JointMapMessage,
    MapMessage,
    MarksMessage,
    OrderMessage,
    StatusMessage,
)
from mapweave_protocol.wire.model import Message
from mapweave_protocol.wire.pairs import Run, name_with_boot, run_of

FAR = 1_000_000  # versions from one message to the next: eleven days of one a second

M = TypeVar("M", bound=Message)
ASKED_AFTER = 4.0  # [s] that a robot is given to see itself that its map is lacking

_log = logging.getLogger(__name__)


def last_version(store: Store) -> JointMap | None:
    """Return the last version that `store` remembers, None when there is none to be read."""
    payload = store.version(store.latest_version)
    message = None if payload is None else _remembered(JointMapMessage, payload)
    return None if message is None else message.unpack()


def _remembered(kind: type[M], payload: bytes) -> M | None:
    """Return a message of the store; what is not valid costs itself, not the store."""
    try:
        return decode(kind, payload)
    except MessageError as error:
        _log.warning("the store: %s; left out", error)
        return None


class Intake:
    """Takes what arrives for a coordinator, and remembers in a store what was news.

    Parameters
    ----------
    coordinator, store
        Where the news goes.
    story
        Turns what happens into lines for the log.
    check_order
        Raises `MessageError` for an order of which nothing proves who gave it.
    """

    def __init__(
        self,
        coordinator: Coordinator,
        store: Store,
        story: Story,
        check_order: Check = unchecked,
    ) -> None:
        self._coordinator = coordinator
        self._store = store
        self._story = story
        self.refusals = Refusals()
        self._maps = map_reader(self.refusals)
        self._alignments = alignment_reader(self.refusals)
        self._statuses = status_reader(self.refusals)
        self._strangers = Strangers(self._forget)
        self._early = EarlyAlignments()
        self._marks = marks_reader(self.refusals)
        self._orders = order_reader(self.refusals)
        self._held_orders = held_orders_reader(self.refusals)
        self._check_order = check_order
        self._heard: dict[Run, StatusMessage] = {}
        self._last_heard: dict[str, float] = {}
        self._lacking = Lacking(ASKED_AFTER)
        self._assembler = MapAssembler()
        self._clashing: set[str] = set()
        self._too_large: set[str] = set()
        self._warned_of_orders = False
        self._attendance = Attendance(None, story)
        self._comings = Bounded("who comes and goes")
        self._looked = 0.0  # [s] by the clock of `look`
        self._met = False

    def met(self) -> bool:
        """Tell whether a robot or another coordinator came since this was asked the last time."""
        met, self._met = self._met, False
        return met

    def look(self, now: float, *, linked: bool) -> None:
        """Tell who has been gone for a while, at `now` [s], and whether that can be known.

        Parameters
        ----------
        linked
            Whether a router is connected: where our own link is away, nobody else need be.
        """
        self._looked = now
        record(self._comings.told(self._attendance.look(now, linked=linked), now))

    @property
    def refused(self) -> int:
        """How many messages were dropped because they were not what they should be."""
        return self.refusals.total

    @property
    def reports(self) -> tuple[RobotReport, ...]:
        """How each robot is, as far as it was heard of."""
        return tuple(
            RobotReport(
                robot,
                runs=len(state.claimants.boots),
                status=state.status,
                heard=self._last_heard.get(robot),
                map_version=self._version_of_run(robot, state.status),
            )
            for robot, state in self._story.robots.items()
        )

    def restore(self) -> None:
        """Take up what the store remembers; what the last version was made of is no news."""
        for payload in self._store.last_maps():
            message = _remembered(MapMessage, payload)
            robot_map = None if message is None else self._assembler.update(message)
            if robot_map is not None:
                self._coordinator.receive_map(robot_map)
        for payload in self._store.last_alignments():
            found = _remembered(AlignmentMessage, payload)
            if found is not None:
                self._coordinator.receive_alignments(found)
        for payload in self._store.last_marks():
            marks = _remembered(MarksMessage, payload)
            if marks is not None:
                self._coordinator.receive_marks(marks)
        for payload in self._store.orders():
            order = _remembered(OrderMessage, payload)
            if order is not None:
                self._coordinator.receive_order(order)
        if self._coordinator.has_version and not self._store.holds_news:
            self._coordinator.forget_news()

    def take(self, arrival: Arrival, received: float) -> None:
        """Take what arrived at `received` [s since 1970]."""
        if self._maps.reads(arrival):
            map_message = self._maps.read(arrival)
            if map_message is not None and self._has_room_for(map_message, arrival.key):
                self._take_map(map_message, received)
        elif self._alignments.reads(arrival):
            message = self._alignments.read(arrival)
            if message is not None:
                self._take_alignments(EarlyAlignment(message, arrival.payload, received))
        elif self._statuses.reads(arrival):
            status = self._statuses.read(arrival)
            if status is not None:
                self._note(status.robot)
                self._heard[status.robot, status.boot] = status
                self._last_heard[status.robot] = received
                record(self._story.status(status))
        elif self._takes_what_was_said(arrival, received):
            return
        elif (coordinator := read_coordinator(arrival, self.refusals)) is not None:
            boot, here = coordinator
            self._met |= here
            record(self._story.coordinator(boot, here=here))
        elif (presence := read_presence(arrival, self.refusals)) is not None:
            self._note(presence.robot)
            self._met |= presence.here
            lines = self._attendance.robot(presence, self._looked)
            record(self._comings.told(lines, self._looked))

    def _takes_what_was_said(self, arrival: Arrival, received: float) -> bool:
        """Take marks and orders; return whether `arrival` was any."""
        if self._marks.reads(arrival):
            marks = self._marks.read(arrival)
            if marks is not None and self._coordinator.receive_marks(marks):
                self._store.keep_marks((marks.robot, marks.boot), received, arrival.payload)
        elif self._orders.reads(arrival):
            order = self._orders.read(arrival)
            if order is not None:
                self._take_order_of(arrival.key, order, received)
        elif self._held_orders.reads(arrival):
            held = self._held_orders.read(arrival)
            for order in held.orders if held is not None else ():
                self._take_order_of(arrival.key, order, received)
        else:
            return False
        return True

    def _take_order_of(self, key: str, order: OrderMessage, received: float) -> None:
        """Take an order that came under `key`, if it proves who gave it; one held is no news."""
        if self._coordinator.orders.holds(order.id):
            return
        try:
            self._check_order(order)
        except MessageError as error:
            self._orders.refuse(key, error)
        else:
            self.take_order(order, received)

    def take_order(self, order: OrderMessage, received: float) -> None:
        """Take an operator's order, which came at `received` [s since 1970]."""
        if self._coordinator.receive_order(order):
            self._store.add_order(order.id, received, encode(order))
        elif self._coordinator.orders.is_full and not self._warned_of_orders:
            self._warned_of_orders = True
            _log.warning("order %s of %s ignored: there are too many already", order.id, order.by)

    def _held_version(self, robot: str) -> int | None:
        held = self._coordinator.map_of(robot)
        return None if held is None else held.version

    def _version_of_run(self, robot: str, status: StatusMessage | None) -> int | None:
        """Return which map is here of the run that said `status`; of the last one if none did."""
        if status is None:
            return self._held_version(robot)
        return self._coordinator.version_of(robot, status.boot)

    def robots_to_ask(self, now: float) -> tuple[list[str], list[str]]:
        """Return whom to ask for what has not arrived, by what they have said.

        Parameters
        ----------
        now
            [s] by any clock.

        Returns
        -------
        maps
            Those whose map is not here.
        orders
            Those who hold other orders than are here.
        """
        heard, self._heard = self._heard, {}
        maps = [robot for (robot, _), status in heard.items() if self._lacks_map(status, now)]
        orders = [robot for (robot, _), status in heard.items() if self._lacks_orders(status, now)]
        return maps, orders

    def _lacks_orders(self, status: StatusMessage, now: float) -> bool:
        held = self._coordinator.orders.digest
        lacks = status.orders not in (b"", held)
        who = f"orders {status.robot} {status.boot}"
        return self._lacking.due(who, (held, status.orders), now, lacks=lacks)

    def _lacks_map(self, status: StatusMessage, now: float) -> bool:
        """Tell whether to ask a robot for its map; also where the one here is not from it."""
        robot, boot = status.robot, status.boot
        held = self._coordinator.version_of(robot, boot)
        lacks = status.submaps > 0 and (held is None or held != status.map_version)
        due = self._lacking.due(f"{robot} {boot}", held, now, lacks=lacks)
        if due and held is not None and held > status.map_version:
            _log.warning(
                "the map of %s here is of version %d, and it has come to %d: asked for it",
                robot, held, status.map_version,
            )  # fmt: skip
            self._coordinator.doubt(robot, boot)
            self._assembler.forget(robot, boot)
        return due

    def _take_map(self, message: MapMessage, received: float) -> None:
        new = self._assembler.update(message)
        # Kept complete, whatever part of it has just come.
        complete = self._pack(new) if new is not None else None
        if new is None or complete is None:
            return
        if self._coordinator.receive_map(new):
            last = max(new.components)
            self._store.keep_map((new.robot, new.boot), last, received, complete)
            record(self._story.mapped(new))
            for found in self._early.take(new.robot, new.boot):
                self._take_alignments(found)
            self._tell_clash(new)

    def _tell_clash(self, new: RobotMap) -> None:
        if self._coordinator.clashes(new) and new.boot not in self._clashing:
            self._clashing.add(new.boot)
            _log.warning(
                "map of %s: another run of it has components of the same numbers; this one's are"
                " named %s/…; give each robot an id of its own",
                new.robot,
                name_with_boot(run_of(new)),
            )

    def _pack(self, robot_map: RobotMap) -> bytes | None:
        """Return the complete message; None if the parts that came make too large a whole."""
        try:
            return encode(self._assembler.complete(robot_map))
        except MessageError as error:
            if robot_map.robot not in self._too_large:
                self._too_large.add(robot_map.robot)
                _log.warning("map of %s ignored, %s", robot_map.robot, error)
            return None

    def _take_alignments(self, found: EarlyAlignment) -> None:
        """Take what was found about maps that are here; what is about others waits for them."""
        new = found.message
        reference, other = (name_with_boot(run_of(end)) for end in (new.reference, new.other))
        if not self._coordinator.has_maps_of(new):
            self._early.keep(found)
        elif self._coordinator.receive_alignments(new):
            self._store.add_alignments((reference, other), found.received, found.payload)
            record(self._story.aligned(new))
        elif self._coordinator.holds(new):
            self._store.renew_alignments((reference, other), found.payload)

    def _note(self, robot: str) -> None:
        self._strangers.heard(robot, has_map=self._held_version(robot) is not None)

    def _forget(self, robot: str) -> None:
        """Forget what is known of a robot that never came with a map."""
        self._story.robots.pop(robot, None)
        self._last_heard.pop(robot, None)
        self._assembler.forget(robot)

    def _has_room_for(self, message: MapMessage, key: str) -> bool:
        """Tell whether a map is taken: of no robot too many, and of no version out of reach."""
        self._note(message.robot)
        held = self._coordinator.version_of(message.robot, message.boot)
        if message.version > (held or 0) + FAR:
            self._maps.refuse(key, f"version {message.version}, far beyond the {held or 0} here")
            return False
        if not self._coordinator.admits({message.robot}):
            self._maps.refuse(key, "there are too many robots already")
            return False
        return True
