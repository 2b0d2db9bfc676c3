"""What a person sees, in a real browser."""

import json
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from urllib.parse import urlsplit

import numpy as np
import pytest
from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import Browser, expect
from playwright.sync_api import Page as Tab

from mapweave.config import Config
from mapweave.evidence import Evidence
from mapweave.maps import Alignment, JointComponent, JointMap, LineMap, RobotMap
from mapweave.marks import PlacedMark
from mapweave.orders import Order, OrderKind
from mapweave.reasons import Reason
from mapweave_fusion_server import journal
from mapweave_fusion_server.store import Store
from mapweave_fusion_server.web.address import HttpAddress
from mapweave_fusion_server.web.feed import CoordinatorReport, Feed, RobotReport
from mapweave_fusion_server.web.server import live_page
from mapweave_protocol.wire.messages import StatusMessage
from tests.fusion_server.web.browser import Visit, chromium, visit
from tests.fusion_server.web.conftest import TOKEN, Page, make_joint, make_pose

pytestmark = pytest.mark.slow
HOSTILE = "<img src=x onerror=alert(1)></script><b id=bold>"
MakeMap = Callable[..., RobotMap]


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with chromium() as browser:
        yield browser


@pytest.fixture
def seen(browser: Browser, page: Page) -> Iterator[Visit]:
    """Return a visit of a page of which nothing is known yet; in the end it was well-behaved."""
    with visit(browser, page.address.url(TOKEN)) as seen:
        expect(seen.tab.locator("#live")).to_have_text("live")
        yield seen
        assert seen.said == []
        assert {urlsplit(url).netloc for url in seen.asked} == {page.address.authority}


def apart(version: int, lines: LineMap, *names: str) -> JointMap:
    """Return a version in which nobody is joined to anybody."""
    sure = np.ones(len(lines.segments))
    places = [{f"{name}/0": np.zeros(3)} for name in names]
    return JointMap(version, tuple(JointComponent(place, 1.0, lines, sure) for place in places), ())


def expect_version(tab: Tab, version: int) -> None:
    expect(tab.locator("#map")).to_have_attribute("data-version", str(version))


def picture(tab: Tab) -> bytes:
    return tab.locator("#map").screenshot()


def test_the_map_appears_and_grows(page: Page, seen: Visit, lines: LineMap) -> None:
    headline = seen.tab.locator("#headline")
    expect(headline).to_have_text("Waiting for the first map…")
    empty = picture(seen.tab)
    page.publish(make_joint(1, lines, a=0.0))
    expect(headline).to_have_text("1 robot in 1 component")
    expect_version(seen.tab, 1)
    assert picture(seen.tab) != empty
    page.publish(make_joint(2, lines, a=0.0, b=3.0))
    expect(headline).to_have_text("2 robots in 1 component, 97% sure")
    expect(seen.tab.locator("#version-text")).to_contain_text("Version 2 of 2")


def test_components_move_together_before_ones_eyes(page: Page, seen: Visit, lines: LineMap) -> None:
    page.publish(apart(1, lines, "a", "b"))
    expect(seen.tab.locator("#headline")).to_have_text(
        "2 robots in 2 components, not joined to each other"
    )
    seen.tab.evaluate(RECORD_MOVES)
    page.publish(make_joint(2, lines, a=0.0, b=0.0))
    expect_version(seen.tab, 2)
    until_still(seen.tab)
    assert seen.tab.evaluate("window.placesDrawn.size") > 8  # each component, on its way


def until_still(tab: Tab) -> bytes:
    """Return the picture when it has come to rest."""
    for _ in range(100):
        before = picture(tab)
        tab.wait_for_timeout(1000)  # as long as components move
        if picture(tab) == before:
            return before
    raise AssertionError("the picture goes on changing")


RECORD_MOVES = """() => {
  window.placesDrawn = new Set();
  const original = CanvasRenderingContext2D.prototype.setTransform;
  CanvasRenderingContext2D.prototype.setTransform = function (...all) {
    window.placesDrawn.add(`${Math.round(all[4])} ${Math.round(all[5])}`);
    return original.apply(this, all);
  };
}"""


def test_a_robot_stands_where_it_says_it_is_and_on_an_old_version_where_it_was(
    page: Page, seen: Visit, lines: LineMap
) -> None:
    page.publish(make_joint(1, lines, a=0.0))
    page.publish(make_joint(2, lines, a=0.0))
    page.feed.show_team((RobotReport("a", 1, None, None, None),), CoordinatorReport())
    expect_version(seen.tab, 2)
    seen.tab.wait_for_timeout(300)
    empty = picture(seen.tab)
    page.feed.positions.take(make_pose("a", 1.0))
    first = until_other(seen.tab, empty)
    page.feed.positions.take(make_pose("a", 2.0))
    second = until_other(seen.tab, first)
    page.feed.positions.take(make_pose("a", 2.0, found=False))
    lost = until_other(seen.tab, second)
    assert len({empty, first, second, lost}) == 4
    seen.tab.locator("#version").fill("1")
    expect_version(seen.tab, 1)
    assert until_other(seen.tab, lost) == empty  # of this version no paths are kept


def until_other(tab: Tab, shown: bytes) -> bytes:
    """Return the first picture that differs from `shown`."""
    for _ in range(100):
        if picture(tab) != shown:
            tab.wait_for_timeout(200)
            return picture(tab)
        tab.wait_for_timeout(100)
    raise AssertionError("the picture stays")


def test_what_follows_is_made_of_what_changed_and_not_fetched(
    page: Page, seen: Visit, lines: LineMap, make_map: MakeMap
) -> None:
    """Robots come and go, components are joined, walls go: it is what is told of the whole."""
    maps = make_map("a"), make_map("b")
    page.publish(make_joint(1, lines, a=0.0), maps[:1])
    expect_version(seen.tab, 1)
    fetched = len(seen.asked)
    later = (
        (apart(2, lines, "a", "b"), maps),
        (with_marks(make_joint(3, lines, a=0.0, b=3.0), "victim"), maps),
        (make_joint(4, replace_segments(lines, 4), a=0.0, b=3.0), maps[1:]),
    )
    for joint, robot_maps in later:
        page.publish(joint, robot_maps)
        expect_version(seen.tab, joint.version)
    expect(seen.tab.locator("#legend")).to_contain_text("the search goes on")
    assert not [url for url in seen.asked[fetched:] if "/api/joint/" in url]
    for version in (2, 3, 4):
        with page.events({"Last-Event-ID": str(version - 1)}) as events:
            event = next(event for event in events if event["event"] == "version")
        changes = json.loads(event["data"])["changes"]
        made, paths = json.loads(seen.tab.evaluate(MAKE_NEXT, [version, changes]))
        whole = page.ask(f"/api/joint/{version}").json
        for component in (*made["components"], *whole["components"]):
            component.pop("frontiers", None)  # what was searched is told apart
            component.pop("explored_m2", None)
        assert made == whole
        assert paths == page.ask(f"/api/joint/{version}/paths").json


MAKE_NEXT = """async ([version, changes]) => {
  const { nextJoint, nextPaths } = await import("/static/next.js");
  const before = await Promise.all(["", "/paths"].map(async (what) =>
    (await fetch(`/api/joint/${version - 1}${what}`)).json()));
  const joint = nextJoint(before[0], version, changes);
  return JSON.stringify([joint, nextPaths(before[1], version, changes.paths)]);
}"""


def test_the_slider_goes_back_and_the_map_is_that_versions(
    page: Page, seen: Visit, lines: LineMap
) -> None:
    page.publish(apart(1, lines, "a", "b"))
    expect_version(seen.tab, 1)
    page.publish(make_joint(2, lines, a=0.0, b=3.0))
    expect_version(seen.tab, 2)
    seen.tab.locator("#version").fill("1")
    expect_version(seen.tab, 1)
    expect(seen.tab.locator("#headline")).to_contain_text("2 components")
    page.publish(make_joint(3, lines, a=0.0, b=3.0))  # who looks back is left there
    expect(seen.tab.locator("#version-text")).to_contain_text("Version 1 of 3")
    assert seen.tab.evaluate("location.hash") == "#v=1"
    seen.tab.locator("#latest").click()
    expect_version(seen.tab, 3)


def test_a_link_leads_to_a_version_and_holds_no_token(
    page: Page, seen: Visit, lines: LineMap
) -> None:
    for version in (1, 2, 3):
        page.publish(make_joint(version, lines, a=0.0))
    expect_version(seen.tab, 3)
    assert TOKEN not in seen.tab.url
    seen.tab.goto("about:blank")
    seen.tab.goto(page.address.url() + "#v=2")
    expect_version(seen.tab, 2)
    expect(seen.tab.locator("#downloads a")).to_have_text(["SVG", "PNG", "GEOJSON", "DXF", "JSON"])
    with seen.tab.expect_download() as download:
        seen.tab.locator("#downloads a", has_text="JSON").last.click()
    assert json.loads(Path(download.value.path()).read_text())["version"] == 2


def test_what_differs_between_two_versions_is_told(page: Page, seen: Visit, lines: LineMap) -> None:
    page.publish(make_joint(1, replace_segments(lines, 4), a=0.0))
    page.publish(make_joint(2, lines, a=0.0))
    expect_version(seen.tab, 2)
    plain = picture(seen.tab)
    seen.tab.locator("#compare").select_option("1")
    expect(seen.tab.locator("#legend")).to_contain_text("only in version 2")
    seen.tab.wait_for_timeout(300)
    assert picture(seen.tab) != plain


def replace_segments(lines: LineMap, count: int) -> LineMap:
    """Return the first `count` segments."""
    return LineMap(
        lines.segments[:count], lines.polyline[:count], lines.support[:count], lines.free_space
    )


def test_a_robot_that_is_killed_is_gone(page: Page, seen: Visit, make_map: MakeMap) -> None:
    robot_map = make_map("a")
    page.publish(make_joint(1, robot_map.lines(0), a=0.0), (robot_map,))
    page.feed.show_team((RobotReport("a", 1, None, 5.0, 1),), CoordinatorReport(stamp=5.0))
    row = seen.tab.locator("#team tbody tr")
    expect(row).to_contain_text("● here")
    expect(seen.tab.locator("#legend")).not_to_contain_text("gone")
    page.feed.show_team((RobotReport("a", 0, None, 5.0, 1),), CoordinatorReport(stamp=9.0))
    expect(row).to_contain_text("○ gone")
    expect(row).to_contain_text("4 s ago")
    expect(seen.tab.locator("#legend")).to_contain_text("robot that is gone")


def with_marks(joint: JointMap, *labels: str) -> JointMap:
    """Return `joint` with a mark of each label in its first component."""
    component, *others = joint.components
    marks = tuple(
        PlacedMark(f"m{k}", label, "anna", 5.0, min(component.robots), np.array([2.0 + k, 2.0]))
        for k, label in enumerate(labels)
    )
    return replace(joint, components=(replace(component, marks=marks), *others))


def drawn_texts(seen: Visit) -> list[str]:
    """Return what is written on the map when it is drawn again."""
    seen.tab.evaluate(RECORD_TEXTS)
    seen.tab.locator("#fit").click()
    seen.tab.wait_for_timeout(300)
    found: list[str] = seen.tab.evaluate("window.textsDrawn")
    return found


RECORD_TEXTS = """() => {
  window.textsDrawn = [];
  const original = CanvasRenderingContext2D.prototype.fillText;
  CanvasRenderingContext2D.prototype.fillText = function (text, ...all) {
    window.textsDrawn.push(text);
    return original.call(this, text, ...all);
  };
}"""


def test_marks_are_on_the_map_and_in_a_list_and_can_be_left_out(
    page: Page, seen: Visit, lines: LineMap
) -> None:
    page.publish(with_marks(make_joint(1, lines, a=0.0), "victim", HOSTILE))
    expect_version(seen.tab, 1)
    expect(seen.tab.locator("#marks")).to_contain_text("victim")
    expect(seen.tab.locator("#marks")).to_contain_text("by anna, on the map of a/0, at 2.0, 2.0 m")
    expect(seen.tab.locator("#marks")).to_contain_text(HOSTILE)
    expect(seen.tab.locator("#legend")).to_contain_text("mark")
    assert {"victim", HOSTILE} <= set(drawn_texts(seen))
    shown = picture(seen.tab)
    seen.tab.locator("#layer-marks").uncheck()
    expect(seen.tab.locator("#legend")).not_to_contain_text("mark")
    seen.tab.wait_for_timeout(300)
    assert picture(seen.tab) != shown
    page.publish(make_joint(2, lines, a=0.0))
    expect(seen.tab.locator("#marks-section")).to_be_hidden()


def test_where_the_search_goes_on_is_on_the_map(page: Page, seen: Visit, lines: LineMap) -> None:
    page.publish(make_joint(1, lines, a=0.0))
    expect_version(seen.tab, 1)
    expect(seen.tab.locator("#legend")).not_to_contain_text("the search goes on")
    open_room = replace_segments(lines, 4)  # two walls are not there: free space ends nowhere
    page.publish(make_joint(2, open_room, a=0.0))
    expect(seen.tab.locator("#legend")).to_contain_text("the search goes on")
    shown = picture(seen.tab)
    seen.tab.locator("#layer-frontiers").uncheck()
    seen.tab.wait_for_timeout(300)
    assert picture(seen.tab) != shown


def joined_with_evidence(version: int, lines: LineMap, *orders: Order) -> JointMap:
    joint = make_joint(version, lines, a=0.0, b=3.0)
    [found] = joint.alignments
    measured = replace(found, evidence=Evidence(common=9.0))
    return replace(joint, alignments=(measured,), orders=orders)


def test_a_join_is_forbidden_after_a_question_and_the_order_is_taken_back_likewise(
    page: Page, seen: Visit, make_map: MakeMap
) -> None:
    maps = make_map("a"), make_map("b")
    page.publish(joined_with_evidence(1, maps[0].lines(0)), maps)
    seen.tab.locator("#decisions button.decision").first.click()
    seen.tab.get_by_role("button", name="Forbid this join…").click()
    dialog = seen.tab.locator("#order")
    expect(dialog).to_contain_text("Forbid to join a/0 and b/0?")
    seen.tab.locator("#order-confirm").click()  # without a name and a reason nothing is sent
    expect(dialog).to_be_visible()
    assert page.feed.orders() == []
    seen.tab.locator("#order-name").fill("anna")
    seen.tab.locator("#order-reason").fill("two floors")
    seen.tab.locator("#order-cancel").click()
    expect(dialog).to_be_hidden()
    assert page.feed.orders() == []
    seen.tab.get_by_role("button", name="Forbid this join…").click()
    seen.tab.locator("#order-name").fill("anna")
    seen.tab.locator("#order-reason").fill("two floors")
    seen.tab.locator("#order-confirm").click()
    expect(dialog).to_be_hidden()
    [given] = page.feed.orders()
    assert (given.kind, given.by, given.reason) == (OrderKind.FORBID, "anna", "two floors")

    told = Order(given.id, OrderKind.FORBID, "anna", 5.0, "two floors", "a/0", "b/0")
    page.publish(joined_with_evidence(2, maps[0].lines(0), told), maps)
    expect(seen.tab.locator("#orders")).to_contain_text("anna forbids a/0 – b/0")
    seen.tab.get_by_role("button", name="Take back…").click()
    expect(seen.tab.locator("#order-name")).to_have_value("anna")  # it is remembered
    seen.tab.locator("#order-reason").fill("one floor after all")
    seen.tab.locator("#order-confirm").click()
    expect(dialog).to_be_hidden()
    [back] = page.feed.orders()
    assert (back.takes_back, back.reason) == (given.id, "one floor after all")


def test_a_join_is_pinned_as_it_is_shown_and_why_it_cannot_be_is_told(
    page: Page, seen: Visit, make_map: MakeMap
) -> None:
    maps = make_map("a"), make_map("b")
    page.publish(joined_with_evidence(1, maps[0].lines(0)), maps)
    seen.tab.locator("#decisions button.decision").first.click()
    seen.tab.get_by_role("button", name="Pin this join…").click()
    seen.tab.locator("#order-name").fill("anna")
    seen.tab.locator("#order-reason").fill("same door")
    page.publish(joined_with_evidence(2, maps[0].lines(0)), ())  # the maps are gone meanwhile
    expect_version(seen.tab, 2)
    seen.tab.locator("#order-confirm").click()
    expect(seen.tab.locator("#order-problem")).to_have_text("no map of component a/0 is here now")
    seen.said.clear()  # the browser notes that the server refused
    page.publish(joined_with_evidence(3, maps[0].lines(0)), maps)
    expect_version(seen.tab, 3)
    seen.tab.locator("#order-confirm").click()
    expect(seen.tab.locator("#order")).to_be_hidden()
    [given] = page.feed.orders()
    assert (given.kind, given.reason) == (OrderKind.PIN, "same door")
    np.testing.assert_allclose(given.transform or (), [3.0, 0.0, 0.0])


def test_who_came_without_the_token_gives_no_orders(
    browser: Browser, page: Page, make_map: MakeMap
) -> None:
    maps = make_map("a"), make_map("b")
    told = Order("0b1", OrderKind.FORBID, "anna", 5.0, "two floors", "a/0", "b/0")
    page.publish(joined_with_evidence(1, maps[0].lines(0), told), maps)
    with visit(browser, page.address.url()) as seen:
        expect_version(seen.tab, 1)
        expect(seen.tab.locator("#orders")).to_contain_text("anna forbids a/0 – b/0")
        seen.tab.locator("#decisions button.decision").first.click()
        expect(seen.tab.locator("#evidence")).to_be_visible()
        for name in ("Forbid this join…", "Pin this join…", "Take back…"):
            expect(seen.tab.get_by_role("button", name=name)).to_have_count(0)


def test_hostile_text_is_shown_as_text(
    page: Page, seen: Visit, lines: LineMap, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level("INFO")
    page.publish(make_joint(1, lines, reason=HOSTILE, a=0.0, b=1.0))
    journal.record([HOSTILE])
    expect(seen.tab.locator("#decisions")).to_contain_text(HOSTILE)
    expect(seen.tab.locator("#story")).to_contain_text(HOSTILE)
    assert seen.tab.locator("main img, #bold").count() == 0


def test_the_page_goes_on_by_itself_when_the_coordinator_is_started_again(
    browser: Browser, tmp_path: Path, lines: LineMap
) -> None:
    with Store(tmp_path / "store.sqlite", "team") as store:
        feed = Feed()
        with live_page(
            HttpAddress("127.0.0.1", 0), "team", store, Config(), feed, TOKEN
        ) as address:
            Page(address, store, feed).publish(make_joint(1, lines, a=0.0))
            context = visit(browser, address.url())
            seen = context.__enter__()
            expect_version(seen.tab, 1)
        expect(seen.tab.locator("#stale")).to_be_visible()
        expect(seen.tab.locator("#live")).to_have_text("no contact")
        feed = Feed()
        feed.show_version(1, ())
        with live_page(address, "team", store, Config(), feed, TOKEN):
            Page(address, store, feed).publish(make_joint(2, lines, a=0.0, b=1.0))
            expect(seen.tab.locator("#live")).to_have_text("live")
            expect(seen.tab.locator("#stale")).to_be_hidden()
            expect_version(seen.tab, 2)
            context.__exit__(None, None, None)


def test_a_decision_shows_what_speaks_for_it_and_against(
    page: Page, seen: Visit, make_map: MakeMap
) -> None:
    maps = make_map("a"), make_map("b")
    page.publish(make_joint(1, maps[0].lines(0), a=0.0, b=0.0), maps)
    decision = seen.tab.locator(".decision")
    expect(decision).to_have_count(1)
    decision.hover()
    evidence = seen.tab.locator("#evidence")
    expect(evidence.locator("canvas")).to_have_count(1)
    expect(evidence).to_contain_text("Nothing different fits")
    seen.tab.mouse.move(10, 10)
    expect(evidence).to_be_hidden()
    decision.focus()
    seen.tab.keyboard.press("Enter")
    expect(evidence).to_be_visible()
    seen.tab.keyboard.press("Escape")
    expect(evidence).to_be_hidden()


def test_what_has_the_focus_keeps_it_while_the_map_grows(
    page: Page, seen: Visit, lines: LineMap
) -> None:
    """As does what is being clicked at that moment."""
    page.publish(make_joint(1, lines, a=0.0, b=1.0))
    page.feed.show_team((RobotReport("a", 1, None, 5.0, 1),), CoordinatorReport(stamp=5.0))
    for focused in (".decision", "#team button", "#compare", "#downloads a"):
        expect(seen.tab.locator(focused).first).to_be_visible()
        seen.tab.locator(focused).first.focus()
        page.publish(make_joint(page.store.latest_version + 1, lines, a=0.0, b=1.0, c=2.0))
        page.feed.show_team((RobotReport("a", 1, None, 6.0, 1),), CoordinatorReport(stamp=9.0))
        expect_version(seen.tab, page.store.latest_version)
        expect(seen.tab.locator("#team")).to_contain_text("3 s ago")
        assert seen.tab.evaluate("document.activeElement.matches('" + focused + "')"), focused


def test_a_distance_is_measured_by_mouse_and_by_keys(
    page: Page, seen: Visit, lines: LineMap
) -> None:
    """The room of 9 m by 7 m: from one end of its longest wall to the other."""
    page.publish(make_joint(1, lines, a=0.0))
    expect_version(seen.tab, 1)
    canvas = seen.tab.locator("#map")
    canvas.focus()
    seen.tab.keyboard.press("m")
    seen.tab.keyboard.press("Enter")
    expect(seen.tab.locator("#measured")).to_have_text("Click the second point")
    for _ in range(3):
        seen.tab.keyboard.press("ArrowRight")
    seen.tab.keyboard.press("Enter")
    expect(seen.tab.locator("#measured")).to_contain_text(" m")
    by_keys = float(seen.tab.locator("#measured").inner_text().split()[0])
    assert 0 < by_keys < 9
    seen.tab.keyboard.press("Escape")
    expect(seen.tab.locator("#measured")).to_be_hidden()


def test_keys_move_zoom_and_turn_the_map_and_fit_it_again(
    page: Page, seen: Visit, lines: LineMap
) -> None:
    page.publish(make_joint(1, lines, a=0.0))
    expect_version(seen.tab, 1)
    expect(seen.tab.locator("#stale")).to_be_visible()  # of no coordinator: it takes its place
    fitted = until_still(seen.tab)
    seen.tab.locator("#map").focus()
    focused = until_still(seen.tab)
    for key in ("ArrowLeft", "+", "[", "-"):
        before = picture(seen.tab)
        seen.tab.keyboard.press(key)
        until_other(seen.tab, before)
    for key in ("0", "f"):
        seen.tab.keyboard.press(key)
    assert until_still(seen.tab) in (focused, fitted)


@pytest.mark.parametrize("dark", [False, True])
@pytest.mark.parametrize("phone", [False, True])
def test_people_who_cannot_see_it_or_use_no_mouse_can_use_it(
    browser: Browser, page: Page, make_map: MakeMap, *, dark: bool, phone: bool
) -> None:
    """As far as axe can tell; with everything open that can be."""
    maps = make_map("a"), make_map("b")
    joint = make_joint(1, maps[0].lines(0), a=0.0, b=0.0)
    alone = JointComponent({"c/0": np.zeros(3)}, 1.0, maps[0].lines(0), np.full(6, 0.5))
    told = Order("0b1", OrderKind.FORBID, "anna", 5.0, "two floors", "a/0", "c/0")
    everything = replace(joint, components=(*joint.components, alone), orders=(told,))
    page.publish(with_marks(everything, "victim"), maps)
    page.feed.show_team((RobotReport("a", 1, None, 5.0, 1),), CoordinatorReport(stamp=5.0))
    with visit(browser, page.address.url(TOKEN), dark=dark, phone=phone) as seen:
        expect(seen.tab.locator("#team tbody tr")).to_have_count(2)
        seen.tab.locator(".decision").first.click()
        expect(seen.tab.locator("#evidence canvas")).to_have_count(1)
        found = Axe().run(seen.tab)
        assert found.violations_count == 0, found.generate_report()
        seen.tab.get_by_role("button", name="Take back…").click()
        found = Axe().run(seen.tab)
        assert found.violations_count == 0, found.generate_report()
        seen.tab.keyboard.press("Escape")
        seen.tab.goto(page.address.url() + "api")
        described = page.ask("/api/openapi.json").json["paths"]
        expect(seen.tab.locator("section")).to_have_count(len(described))
        found = Axe().run(seen.tab)
        assert found.violations_count == 0, found.generate_report()
        assert seen.said == []


def test_on_a_phone_nothing_is_wider_than_the_screen(
    browser: Browser, page: Page, lines: LineMap
) -> None:
    page.publish(make_joint(1, lines, a=0.0, b=1.0))
    with visit(browser, page.address.url(), phone=True) as seen:
        expect_version(seen.tab, 1)
        assert seen.tab.evaluate("document.documentElement.scrollWidth") <= 390


def told_of(robot: str, **also: int) -> StatusMessage:
    counts = {"scans_seen": 14640, "scans_placed": 13255, "scans_total": 14640, **also}
    fields = {"boot": "b", "stamp": 0.0, "state": "mapping", "components": 3, "submaps": 128}
    traffic = {"map": {"messages": 283, "bytes": 987_000}}
    return StatusMessage.model_validate(
        {"robot": robot, "map_version": 283, "sent": traffic, **counts, **fields}
    )


@pytest.mark.parametrize("ago", [1.0, 21.0, 5300.0])
def test_all_of_the_team_is_within_its_panel_however_much_there_is_to_say(
    ago: float, page: Page, seen: Visit
) -> None:
    seen.tab.set_viewport_size({"width": 1400, "height": 900})
    robots = tuple(
        RobotReport(robot, 2, told_of(robot), 1000.0 - ago, 68) for robot in ("r1", "r" * 32)
    )
    page.feed.show_team(robots, CoordinatorReport(stamp=1000.0))
    behind = seen.tab.locator("#team small", has_text="215 behind here").first
    expect(behind).to_be_visible()
    assert seen.tab.evaluate("""() => {
      const panel = document.querySelector(".panel");
      return panel.scrollWidth <= panel.clientWidth;
    }""")
    box = behind.bounding_box()
    assert box is not None
    assert box["height"] < 25, "one line"


def refused(reference: str, other: str, common: float) -> Alignment:
    reason = Reason.words(f"only {common} m of wall in common")
    evidence = Evidence(common=common, contradicted=0.0, overlap=1.0, score=common)
    sure = 0.02 / (1.0 + common)  # of what is refused, no measure of how close it is
    return Alignment(
        *(f"{reference}/0", f"{other}/0", np.zeros(3), "refused", sure, reason), evidence=evidence
    )


def test_of_what_is_refused_the_closest_has_most_in_common(
    page: Page, seen: Visit, lines: LineMap
) -> None:
    joint = apart(1, lines, "a", "b", "c")
    found = (refused("a", "b", 0.5), refused("a", "c", 1.4), refused("b", "c", 0.9))
    page.publish(replace(joint, alignments=found))
    sure = seen.tab.locator("#sure li").first
    expect(sure).to_contain_text("a/0 – c/0: only 1.4 m of wall in common")
    expect(sure).not_to_contain_text("%")
    expect(seen.tab.locator("#decisions li").first).to_contain_text(
        "coincides where both looked100%"
    )
