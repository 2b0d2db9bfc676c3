"""Who is let through: pages of this server and programs of this machine."""

from collections.abc import Iterator

import pytest

from mapweave_fusion_server.web.address import HttpAddress
from tests.fusion_server.web.conftest import TOKEN, Page, served


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    """Return a page that nothing here changes."""
    with served(tmp_path_factory.mktemp("page")) as page:
        yield page


PATHS = ["/", "/api/robots", "/events", "/static/main.js", "/not/there"]
every_path = pytest.mark.parametrize("path", PATHS)


@every_path
@pytest.mark.parametrize("host", ["evil.example", "127.0.0.1", "127.0.0.1:1", "", "evil.localhost"])
def test_a_name_that_was_made_to_point_here_is_refused(page: Page, path: str, host: str) -> None:
    assert page.ask(path, headers={"Host": host}).status == 403


def test_localhost_is_a_name_of_this_server(page: Page) -> None:
    host = f"localhost:{page.address.port}"
    origin = f"http://{host}"
    assert page.ask("/api/robots", headers={"Host": host, "Origin": origin}).status == 200


@every_path
@pytest.mark.parametrize(
    "origin", ["https://evil.example", "null", "http://127.0.0.1", "http://127.0.0.1:1"]
)
def test_a_page_of_another_site_is_refused(page: Page, path: str, origin: str) -> None:
    for token in ("", TOKEN):
        headers = {"Origin": origin, "X-Mapweave-Token": token}
        assert page.ask(path, headers=headers).status == 403
        assert page.ask(path, "POST", headers).status == 403


def test_another_site_may_link_here_and_not_embed(page: Page) -> None:
    follows = {"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "navigate"}
    embeds = {"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "no-cors"}
    assert page.ask("/", headers=follows).status == 200
    assert page.ask("/static/main.js", headers=embeds).status == 403


@every_path
@pytest.mark.parametrize("method", ["POST", "PUT", "DELETE", "PATCH", "OPTIONS"])
def test_what_is_no_read_needs_the_token_on_this_machine_too(
    page: Page, path: str, method: str
) -> None:
    own = {"Origin": page.address.url().rstrip("/")}
    assert page.ask(path, method, own).status == 403
    assert page.ask(path, method, own | {"X-Mapweave-Token": TOKEN[:-1]}).status == 403
    # No order is known yet: who has the token hears that.
    assert page.ask(path, method, own | {"X-Mapweave-Token": TOKEN}).status in (404, 405)


def test_a_form_of_another_site_changes_nothing(page: Page) -> None:
    form = {
        "Origin": "https://evil.example",
        "Content-Type": "application/x-www-form-urlencoded",
        "Content-Length": "0",
    }
    assert page.ask("/api/joint", "POST", form).status == 403


@pytest.mark.parametrize("path", ["/", "/api/robots", "/static/main.js", "/not/there"])
@pytest.mark.parametrize("host", [None, "evil.example"])
def test_every_answer_forbids_scripts_and_frames_of_others(
    page: Page, path: str, host: str | None
) -> None:
    answer = page.ask(path, headers={} if host is None else {"Host": host})
    policy = answer.headers["Content-Security-Policy"]
    assert "default-src 'none'" in policy
    assert "script-src 'self'" in policy
    assert "frame-ancestors 'none'" in policy
    assert "unsafe" not in policy
    assert answer.headers["X-Content-Type-Options"] == "nosniff"
    assert answer.headers["Cross-Origin-Resource-Policy"] == "same-origin"
    assert "Access-Control-Allow-Origin" not in answer.headers


@pytest.mark.parametrize("path", ["/static/../server.py", "/static/%2e%2e/server.py", "/static/"])
def test_nothing_but_the_page_is_served(page: Page, path: str) -> None:
    assert page.ask(path).status == 404


def test_an_address_of_ipv6_is_named_in_brackets() -> None:
    assert HttpAddress("::1", 8080).authority == "[::1]:8080"
