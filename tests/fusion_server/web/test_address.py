"""Where the page may be served."""

from dataclasses import replace
from pathlib import Path

import pytest

from mapweave.errors import ArgumentError, FileError
from mapweave_fusion_server.web.address import (
    HttpAddress,
    http_address,
    loopback_address,
    new_token,
    with_keys,
)
from mapweave_protocol.link.security.folder import KeyFolder
from mapweave_protocol.link.security.roster import Member, Role, Roster


@pytest.mark.parametrize(
    ("text", "host", "port"),
    [
        ("127.0.0.1:8080", "127.0.0.1", 8080),
        ("127.8.9.1:1", "127.8.9.1", 1),
        ("localhost:0", "127.0.0.1", 0),
        ("LocalHost:65535", "127.0.0.1", 65535),
        ("[::1]:80", "::1", 80),
    ],
)
def test_a_host_of_this_machine_and_a_port_are_an_address(text: str, host: str, port: int) -> None:
    assert loopback_address(text) == HttpAddress(host, port)


@pytest.mark.parametrize("text", ["0.0.0.0:8080", "192.168.1.4:80", "[::]:80"])
def test_what_another_machine_could_reach_is_refused_in_one_line(text: str) -> None:
    with pytest.raises(ValueError, match="on this machine only") as refused:
        loopback_address(text)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("text", ["8080", "127.0.0.1", "127.0.0.1:", "127.0.0.1:65536", "::1:80"])
def test_what_is_no_host_and_port_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="expected HOST:PORT"):
        loopback_address(text)


def test_a_name_of_who_knows_whom_is_no_address_of_this_machine() -> None:
    for text in ("example.org:80", "127.0.0.1.evil.org:80"):
        with pytest.raises(ValueError, match="expected an IP address of this machine"):
            http_address(text)


def test_what_others_reach_needs_keys_and_what_they_do_not_takes_none(tmp_path: Path) -> None:
    keys = KeyFolder(tmp_path, Member("rescue", Role.COORDINATOR, "coordinator"), Roster("rescue"))
    page = replace(keys, page=("base.local", "fd00::7"))
    here, everywhere = http_address("127.0.0.1:80"), http_address("0.0.0.0:443")
    assert with_keys(here, page).keys is None
    with pytest.raises(ArgumentError, match=r"--http: 0\.0\.0\.0:443: .*--tls DIR"):
        with_keys(everywhere, None)
    with pytest.raises(FileError, match="mapweave keys TEAM --page HOST"):
        with_keys(everywhere, keys)
    given = with_keys(everywhere, page)
    assert given.url("secret") == "https://base.local:443/"
    assert set(given.names) == {"base.local:443", "base.local", "[fd00::7]:443", "[fd00::7]"}


def test_the_token_stands_where_no_browser_sends_it_by_itself() -> None:
    assert HttpAddress("::1", 80).url("secret") == "http://[::1]:80/#token=secret"


def test_no_token_is_given_twice() -> None:
    assert len({new_token() for _ in range(100)}) == 100
