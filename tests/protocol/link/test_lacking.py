import itertools

from mapweave_protocol.link.lacking import GRACE, LONGEST, MAX_WATCHED, Lacking

END = 10 * LONGEST  # [s]


def times(lacking: Lacking) -> list[float]:
    """Return when something is done for one that never gets what it lacks."""
    each_quarter = (quarter / 4 for quarter in range(int(4 * END)))
    return [now for now in each_quarter if lacking.due("a", 1, now, lacks=True)]


def test_nothing_is_done_for_who_lacks_nothing() -> None:
    lacking = Lacking()
    assert not any(lacking.due("a", 1, float(now), lacks=False) for now in range(100))


def test_what_may_be_on_its_way_is_not_sent_again_at_once() -> None:
    assert times(Lacking())[0] == GRACE


def test_who_never_takes_what_it_lacks_gets_it_ever_more_rarely_but_for_ever() -> None:
    done = times(Lacking())
    pauses = [later - earlier for earlier, later in itertools.pairwise(done)]
    assert pauses == sorted(pauses)
    assert pauses[0] == 2 * GRACE
    assert pauses[-1] == LONGEST


def test_who_makes_progress_is_left_alone() -> None:
    lacking = Lacking()
    assert not any(lacking.due("a", now, float(now), lacks=True) for now in range(100))


def test_who_caught_up_and_falls_behind_again_is_waited_for_anew() -> None:
    lacking = Lacking()
    last = times(lacking)[-1]
    lacking.due("a", 2, last + 1, lacks=False)
    assert not lacking.due("a", 2, last + 2, lacks=True)
    assert lacking.due("a", 2, last + 2 + GRACE, lacks=True)


def test_each_is_watched_for_itself() -> None:
    lacking = Lacking()
    lacking.due("a", 1, 0.0, lacks=True)
    assert not lacking.due("b", 1, GRACE, lacks=True)
    assert lacking.due("a", 1, GRACE, lacks=True)


def test_of_names_without_end_the_oldest_are_forgotten() -> None:
    lacking = Lacking()
    for number in range(MAX_WATCHED + 1):
        lacking.due(str(number), 1, 0.0, lacks=True)
    assert not lacking.due("0", 1, GRACE, lacks=True)
    assert lacking.due(str(MAX_WATCHED), 1, GRACE, lacks=True)
