"""Who says what on a ROS 2 network, by the liveliness tokens of `rmw_zenoh`.

A token names a node, or a publisher or subscription of one::

    @ros2_lv/<domain>/<session>/<node>/<entity>/MP/<enclave>/<namespace>/<node>/<topic>/<type>/…

with ``%`` for every slash of a name.
"""

import re

import zenoh

_NUMBER = re.compile(r"[0-9]{1,3}")
_TOKENS = "@ros2_lv/*/*/*/*/MP/*/*/*/*/{dds_type}/*/*"
_DOMAIN, _TOPIC = 1, 9  # which parts of a token


def topics_of_type(session: zenoh.Session, dds_type: str, timeout: float) -> list[tuple[int, str]]:
    """Return domain and name of the topics of `dds_type` that somebody publishes, in their order.

    The bridge declares no tokens: its topics are not among them.
    """
    tokens = session.liveliness().get(_TOKENS.format(dds_type=dds_type), timeout=timeout)
    parts = [str(reply.ok.key_expr).split("/") for reply in tokens if reply.ok is not None]
    named = [(part[_DOMAIN], part[_TOPIC].replace("%", "/")) for part in parts]
    return sorted({(int(domain), topic) for domain, topic in named if _NUMBER.fullmatch(domain)})
