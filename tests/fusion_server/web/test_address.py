"""Where the page may be served."""

import pytest

from mapweave_fusion_server.web.address import HttpAddress, loopback_address, new_token


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


@pytest.mark.parametrize(
    "text", ["0.0.0.0:8080", "192.168.1.4:80", "[::]:80", "example.org:80", "127.0.0.1.evil.org:80"]
)
def test_what_another_machine_could_reach_is_refused_in_one_line(text: str) -> None:
    with pytest.raises(ValueError, match="on this machine only") as refused:
        loopback_address(text)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("text", ["8080", "127.0.0.1", "127.0.0.1:", "127.0.0.1:65536", "::1:80"])
def test_what_is_no_host_and_port_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="expected HOST:PORT"):
        loopback_address(text)


def test_the_token_stands_where_no_browser_sends_it_by_itself() -> None:
    assert HttpAddress("::1", 80).url("secret") == "http://[::1]:80/#token=secret"


def test_no_token_is_given_twice() -> None:
    assert len({new_token() for _ in range(100)}) == 100
