"""A status is sent when something has changed, when somebody comes, and now and then."""

from mapweave_protocol.link.status_schedule import AGAIN, StatusSchedule


def test_a_status_is_sent_on_a_change_and_now_and_then() -> None:
    statuses = StatusSchedule(10.0, 1.0)
    assert statuses.due(0.0, "mapping")
    statuses.sent(0.0, "mapping")
    assert not statuses.due(9.9, "mapping")
    assert statuses.due(10.0, "mapping")
    assert not statuses.due(0.9, "finished")
    assert statuses.due(1.0, "finished")


def test_no_status_need_be_made_before_one_may_be_sent() -> None:
    """Whatever has changed, and unless something is waited for."""
    statuses = StatusSchedule(10.0, 1.0)
    assert statuses.may_be_due(0.0)
    statuses.sent(0.0, "mapping")
    assert not statuses.may_be_due(0.9)
    assert statuses.may_be_due(1.0)
    statuses.hurry()
    assert statuses.may_be_due(0.1)


def test_who_lacks_something_says_so_twice_as_often() -> None:
    statuses = StatusSchedule(10.0, 1.0)
    statuses.sent(0.0, "mapping")
    assert not statuses.due(4.9, "mapping", lacks=True)
    assert statuses.due(5.0, "mapping", lacks=True)
    assert not statuses.due(5.0, "mapping")


def test_what_is_waited_for_does_not_wait() -> None:
    statuses = StatusSchedule(10.0, 1.0)
    statuses.sent(0.0, "mapping")
    statuses.hurry()
    assert statuses.due(0.1, "mapping")


def test_whoever_comes_hears_at_once_and_when_what_was_missing_should_have_come() -> None:
    statuses = StatusSchedule(10.0, 1.0)
    statuses.sent(0.0, "mapping")
    statuses.met(1.0)
    assert statuses.due(1.0, "mapping")
    statuses.sent(1.0, "mapping")
    assert not statuses.due(0.9 + AGAIN, "mapping")
    assert statuses.due(1.0 + AGAIN, "mapping")
    statuses.sent(1.0 + AGAIN, "mapping")
    assert statuses.due(1.0 + 2 * AGAIN, "mapping")
    statuses.sent(1.0 + 2 * AGAIN, "mapping")
    assert not statuses.due(10.9 + 2 * AGAIN, "mapping")
