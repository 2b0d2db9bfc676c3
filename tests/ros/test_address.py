"""What may be asked of a ROS 2 network."""

import math

import pytest

from mapweave.errors import MissingExtraError
from mapweave.io.readers.options import ReadOptions
from mapweave.scan.mounting import Mounting
from mapweave_protocol.errors import EndpointError
from mapweave_ros.address import Laser, Ros2Address
from mapweave_ros.errors import Ros2NetworkError, Ros2SourceError
from mapweave_ros.network import Ros2Network
from mapweave_ros.source import open_ros2


def test_a_topic_alone_is_on_the_teams_network_in_the_domain_of_the_environment() -> None:
    address = Ros2Address.parse("ros2:/r1/scan", ["tcp/router:7447"], {"ROS_DOMAIN_ID": "12"})
    assert address == Ros2Address((Laser("/r1/scan"),), Ros2Network(("tcp/router:7447",), 12))


def test_a_word_says_network_domain_and_where_each_laser_sits() -> None:
    address = Ros2Address.parse(
        "ros2:/front@0.2,-0.1,45+/rear@-0.2,0,180,upside-down?connect=tcp/a:1,tcp/b:2&domain=232"
    )
    front, rear = Mounting(0.2, -0.1, math.radians(45)), Mounting(-0.2, 0.0, math.pi, True)
    assert address.lasers == (Laser("/front", front), Laser("/rear", rear))
    assert address.network == Ros2Network(("tcp/a:1", "tcp/b:2"), 232)


@pytest.mark.parametrize(
    ("word", "problem"),
    [
        ("ros2:", "'' is no topic"),
        ("ros2:scan", "'scan' is no topic"),
        ("ros2:/scan/*", "'/scan/\\*' is no topic"),
        ("ros2:/scan@1,2", "'1,2' is no mounting"),
        ("ros2:/scan@1,2,nan", "'1,2,nan' is no mounting"),
        ("ros2:/a@0,0,0+/a@0,0,0", "names a topic twice"),
        ("ros2:/a?domain=233", "domain '233' is no number from 0 to 232"),
        ("ros2:/a?domain=", "domain ''"),
        ("ros2:/a?distro=22.04", "distro '22.04' is none of humble"),
        ("ros2:/a?distro=humbel", "distro 'humbel' is none of humble"),
        ("ros2:/a?router=tcp/a:1", "nothing is known of 'router'"),
    ],
)
def test_what_names_no_laser_is_refused_in_one_line(word: str, problem: str) -> None:
    with pytest.raises((Ros2SourceError, Ros2NetworkError), match=problem) as raised:
        Ros2Address.parse(word, environment={})
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize("word", ["", "foo", "ros2", "ros1:", "ros2:/scan", "ros2:x?domain=1"])
def test_what_is_no_network_is_refused_rather_than_taken_for_the_teams(word: str) -> None:
    with pytest.raises(Ros2NetworkError, match=r"expected ros2: and"):
        Ros2Network.parse(word, ["tcp/router:7447"], {})


def test_humble_names_no_hashes() -> None:
    assert not Ros2Network.parse("ros2:?distro=humble", environment={}).hashed
    assert Ros2Network.parse("ros2:", environment={}).hashed


def test_an_endpoint_that_is_none_is_refused_before_anybody_listens() -> None:
    with pytest.raises(EndpointError):
        Ros2Address.parse("ros2:/scan?connect=router")


def test_without_the_extra_it_is_said_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "rosbags.typesys", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'mapweave\[ros2\]'"):
        open_ros2("ros2:/scan", ReadOptions())
