"""A real browser that looks at the page, and what it must never do meanwhile."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

import pytest
from playwright.sync_api import Browser, ConsoleMessage, Request, expect, sync_playwright
from playwright.sync_api import Page as Tab

NAMES = ("chromium", "chromium-browser", "google-chrome")
ARGUMENTS = (  # those that a browser in a container takes
    "--no-sandbox",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
)
SIZE = {"width": 1280, "height": 800}
expect.set_options(timeout=30_000)  # [ms], on a machine that is busy


@dataclass
class Visit:
    """A tab that looks at a page.

    Attributes
    ----------
    tab
        The browser's.
    said
        Errors and warnings of the console: violations of the content security policy are there.
    asked
        Addresses of all requests.
    """

    tab: Tab
    said: list[str] = field(default_factory=list)
    asked: list[str] = field(default_factory=list)

    def listen(self) -> None:
        """Note what the tab says and asks for."""
        self.tab.on("console", self._take_console)
        self.tab.on("pageerror", lambda error: self.said.append(str(error)))
        self.tab.on("dialog", lambda dialog: self.said.append(f"dialog {dialog.message}"))
        self.tab.on("request", self._take_request)

    def _take_console(self, message: ConsoleMessage) -> None:
        if message.type in ("error", "warning"):
            self.said.append(message.text)

    def _take_request(self, request: Request) -> None:
        self.asked.append(request.url)


@contextmanager
def chromium() -> Iterator[Browser]:
    """Give a browser; fail where there is none, rather than leave the page untested."""
    found = next(filter(None, map(shutil.which, NAMES)), None)
    if found is None:
        pytest.fail("no Chromium here, which tests of the page need: apt-get install chromium")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=found, args=list(ARGUMENTS))
        yield browser
        browser.close()


@contextmanager
def visit(
    browser: Browser, url: str, *, dark: bool = False, phone: bool = False
) -> Iterator[Visit]:
    """Open `url` in a tab of its own."""
    context = browser.new_context(
        viewport={"width": 390, "height": 844} if phone else SIZE,  # type: ignore[arg-type]
        color_scheme="dark" if dark else "light",
        has_touch=phone,
    )
    seen = Visit(context.new_page())
    seen.listen()
    seen.tab.goto(url)
    yield seen
    context.close()
