"""A reason has the numbers of its kind, a status what is its own; both are told in one place."""

import pickle

import pytest
from hypothesis import given

from mapweave.evidence import Evidence
from mapweave.reasons import MAX_DEPTH, Reason, ReasonKind, Status, StatusKind
from mapweave.text import MAX_LENGTH, percent, tell_cause, tell_reason
from tests.alignment_strategies import ABOUT_FOUND, NEEDED, reasons, statuses

ENDS = "a/0", "b/7"
RELIED_ON, HELD = Status(StatusKind.RELIED_ON), Status(StatusKind.HELD)
MATCH = {"common": 40.4, "contradicted": 0.31}
RIVAL = {"distance": 9.2, "turn": 0.05, "rival_common": 12.0, "rival_contradicted": 3.0}
TURNED = {**RIVAL, "turn": 3.14159}
FOUND = Reason(ReasonKind.CONVINCING, MATCH)
TOLD = "40 m of wall in common, 0.3 m contradicted; nothing else fits"
FITS = "40 m of wall in common, 0.3 m contradicted"
ELSE = "12 m of wall in common, 3.0 m contradicted"


@pytest.mark.parametrize(
    ("cause", "sentence"),
    [
        (Reason(ReasonKind.SMALL_REFERENCE, {"min_wall": 4.0}),
         "a/0 has less than 4 m of wall to compare"),
        (Reason(ReasonKind.SMALL_OTHER, {"min_wall": 4.5}),
         "b/7 has less than 4.5 m of wall to compare"),
        (Reason(ReasonKind.NO_SHAPE), "no part of one has the shape of a part of the other"),
        (Reason(ReasonKind.LITTLE_COMMON, {"common": 2.14}), "only 2.1 m of wall in common"),
        (Reason(ReasonKind.CONTRADICTED, {"common": 40.4, "contradicted": 12.3}),
         "40 m of wall in common, but 12 m of wall where the other saw free space"),
        (Reason(ReasonKind.CONTRADICTED, {"common": 8.2, "contradicted": 0.46}),
         "8 m of wall in common, but 0.5 m of wall where the other saw free space"),
        (Reason(ReasonKind.PARALLEL, MATCH),
         f"{FITS}; nearly all of it parallel, so one may slide along the other"),
        (Reason(ReasonKind.STRAIGHT, MATCH),
         f"{FITS}; but only straight walls, no shape that tells places apart"),
        (Reason(ReasonKind.RIVAL, {**MATCH, **RIVAL}),
         f"{FITS}; but 9 m away fits as well, with {ELSE}"),
        (Reason(ReasonKind.RIVAL, {**MATCH, **TURNED}),
         f"{FITS}; but 9 m away and turned by 180° fits as well, with {ELSE}"),
        (Reason(ReasonKind.ONE_ROOM, {**MATCH, "outside": 1.2, "confidence": 0.79}),
         f"{FITS}; without one room 1 m of it tell the place: the same room may exist twice (79%)"),
        (Reason(ReasonKind.ONE_KIND, {**MATCH, "confidence": 0.79}),
         f"{FITS}; but both are bare and neither saw more, or doors of one are walls of the other,"
         " or more fits mirrored: the same wing may exist twice (79%)"),
        (Reason(ReasonKind.UNSURE, {**MATCH, "confidence": 0.614}),
         f"{FITS}; nothing else fits; too little to be sure of the place (61%)"),
        (Reason(ReasonKind.UNSURE, {**MATCH, **RIVAL, "confidence": 0.614}),
         f"{FITS}; next best, 9 m away, has {ELSE}; too little to be sure of the place (61%)"),
        (FOUND, TOLD),
        (Reason(ReasonKind.CONVINCING, {**MATCH, **TURNED}),
         f"{FITS}; next best, 9 m away and turned by 180°, has {ELSE}"),
        (Reason(ReasonKind.PARTS_AGREE, {"parts": 3.0, "spread": 0.42}, FOUND),
         f"3 pairs of parts agree within 0.4 m; the best held: {TOLD}"),
        (Reason(ReasonKind.BENT, {"reach": 40.2, "tolerance": 0.5, "confidence": 0.4}, FOUND),
         f"{TOLD}; but from there the maps go on for 40 m, where they may be bent by more than"
         " 0.5 m: right as a whole with 40% only"),
        (Reason(ReasonKind.MET_BEFORE, found=FOUND), f"the robots met before; {TOLD}"),
        (
            Reason(ReasonKind.FOLLOWED, found=FOUND),
            f"by the stored map that one of them follows in; {TOLD}",
        ),
        (Reason(ReasonKind.PINNED, text="anna: same door"), "pinned by anna: same door"),
        (Reason(ReasonKind.PINNED, found=FOUND, text="anna: same door"),
         f"pinned by anna: same door; {TOLD}"),
        (Reason(ReasonKind.FORBIDDEN, found=FOUND, text="anna: two floors"),
         f"forbidden by anna: two floors; {TOLD}"),
        (Reason(ReasonKind.REBASED),
         "what was compared is in another component by now; to be compared again"),
        (Reason(ReasonKind.UNDECIDED, found=FOUND),
         f"contradicts others, and nothing tells for sure which is wrong; {TOLD}"),
        (Reason.words("{so} it is"), "{so} it is"),
    ],
)  # fmt: skip
def test_a_reason_is_told_in_one_sentence(cause: Reason, sentence: str) -> None:
    assert tell_reason(cause, ENDS, None) == sentence


@pytest.mark.parametrize(
    ("by", "who"),
    [
        ([], "others say"),
        (["ac"], "a/0-c/0 says"),
        (["ac", "bc"], "a/0-c/0 and b/0-c/0 say"),
        (["ac", "bc", "bd"], "a/0-c/0, b/0-c/0 and b/0-d/0 say"),
        (["ac", "bc", "bd", "cd"], "a/0-c/0, b/0-c/0 and 2 more say"),
    ],
)
def test_who_sets_aside_is_named_of_many_the_first(by: list[str], who: str) -> None:
    cause = Reason(ReasonKind.OTHERS_CONTRADICT, {"distance": 9.04, "turn": 0.5}, FOUND)
    pairs = tuple((f"{pair[0]}/0", f"{pair[1]}/0") for pair in by)
    status = Status(StatusKind.SET_ASIDE, pairs)
    assert tell_reason(cause, ENDS, status) == f"set aside: 9.0 m and 29° off what {who}; {TOLD}"


@pytest.mark.parametrize(
    ("kind", "end"),
    [
        (ReasonKind.MAPS_CONTRADICT, ""),
        (
            ReasonKind.MAPS_CONTRADICT_JOINTLY,
            ", by this alignment or another one between them",
        ),
    ],
)
def test_maps_that_contradict_each_other_are_named(kind: ReasonKind, end: str) -> None:
    cause = Reason(kind, {"common": 3.2, "contradicted": 17.8}, FOUND)
    status = Status(StatusKind.SET_ASIDE, (("a/0", "c/0"),))
    assert tell_cause(cause, ENDS, status) == (
        "a/0 and c/0 would have 18 m of wall where the other saw free space, 3 m in common"
        f"{end}; {TOLD}"
    )


@pytest.mark.parametrize(
    ("status", "sentence"),
    [
        (None, TOLD),
        (RELIED_ON, TOLD),
        (HELD, TOLD),
        (Status(StatusKind.SET_ASIDE), f"set aside: {TOLD}"),
        (Status(StatusKind.REVOKED, revoked_in=12), f"revoked in version 12: {TOLD}"),
    ],
)
def test_what_became_of_an_alignment_begins_its_reason(
    status: Status | None, sentence: str
) -> None:
    assert tell_reason(FOUND, ENDS, status) == sentence
    assert tell_cause(FOUND, ENDS, status) == TOLD


@given(cause=reasons(), status=statuses())
def test_every_reason_is_one_line_short_enough_to_be_sent(cause: Reason, status: Status) -> None:
    sentence = tell_reason(cause, ENDS, status)
    assert sentence.isprintable()
    assert len(sentence) <= MAX_LENGTH


def test_a_sentence_that_is_cut_says_so() -> None:
    sentence = tell_reason(Reason.words("x" * 501), ENDS, None)
    assert sentence == f"{'x' * 499}…"


def test_what_is_nearly_certain_is_not_told_as_certain() -> None:
    assert [percent(p) for p in (0.0, 0.614, 0.994, 0.995, 1.0)] == [
        "0%", "61%", "99%", "over 99%", "over 99%",
    ]  # fmt: skip


@pytest.mark.parametrize("kind", list(ReasonKind))
def test_a_reason_has_the_numbers_of_its_kind_and_no_other(kind: ReasonKind) -> None:
    found = FOUND if kind in ABOUT_FOUND else None
    (needed, *_) = NEEDED.get(kind, [ABOUT_FOUND.get(kind, [])])
    numbers = dict.fromkeys(needed, 1.0)
    Reason(kind, numbers, found)
    with pytest.raises(ValueError, match=f"reason {kind}: expected"):
        Reason(kind, {**numbers, "colour": 1.0}, found)
    for name in numbers:
        with pytest.raises(ValueError, match=name):
            Reason(kind, {n: v for n, v in numbers.items() if n != name}, found)
    if kind is ReasonKind.PINNED:  # also where nothing was found
        Reason(kind, numbers)
        return
    with pytest.raises(ValueError, match="what was found before"):
        Reason(kind, numbers, None if found else FOUND)


def test_of_a_rival_all_is_known_or_nothing() -> None:
    with pytest.raises(ValueError, match="convincing"):
        Reason(ReasonKind.CONVINCING, {**MATCH, "distance": 3.0})


def test_only_words_and_orders_have_a_text_and_reasons_in_a_row_are_bounded() -> None:
    with pytest.raises(ValueError, match="no words"):
        Reason(ReasonKind.NO_SHAPE, text="so")
    deep = FOUND
    for _ in range(MAX_DEPTH - 1):
        deep = Reason(ReasonKind.MET_BEFORE, found=deep)
    with pytest.raises(ValueError, match=f"at most {MAX_DEPTH}"):
        Reason(ReasonKind.MET_BEFORE, found=deep)


@pytest.mark.parametrize("kind", list(StatusKind))
def test_only_what_is_revoked_names_a_version(kind: StatusKind) -> None:
    with pytest.raises(ValueError, match=f"status {kind}: expected a version"):
        Status(kind, revoked_in=None if kind is StatusKind.REVOKED else 3)


@pytest.mark.parametrize(
    ("status", "relied_on"),
    [
        (RELIED_ON, True),
        (HELD, True),
        (Status(StatusKind.SET_ASIDE), False),
        (Status(StatusKind.REVOKED, revoked_in=2), False),
    ],
)
def test_only_what_is_relied_on_or_held_is_set_aside_by_nothing(
    status: Status, relied_on: bool
) -> None:
    assert status.is_relied_on == relied_on
    if relied_on:
        with pytest.raises(ValueError, match="nothing that sets it aside"):
            Status(status.kind, (("a/0", "c/0"),))


@given(cause=reasons(), status=statuses())
def test_reasons_and_statuses_pass_between_processes(cause: Reason, status: Status) -> None:
    assert pickle.loads(pickle.dumps((cause, status))) == (cause, status)


def test_evidence_is_named_as_far_as_it_was_measured_and_other_names_are_left_out() -> None:
    evidence = Evidence.of({"place": 0.9, "common": 3.0, "colour": 7.0})
    assert evidence == Evidence(common=3.0, place=0.9)
    assert list(evidence.by_name().items()) == [("common", 3.0), ("place", 0.9)]
    assert not evidence.is_empty
    assert Evidence().is_empty
    assert not Evidence(common=0.0).is_empty
