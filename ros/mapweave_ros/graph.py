"""Who says what on a ROS 2 network, by the liveliness tokens of `rmw_zenoh`.

A token names a node, or a publisher or subscription of one::

    @ros2_lv/<domain>/<session>/<node>/<entity>/MP/<enclave>/<namespace>/<node>/<topic>/<type>/…

with ``%`` for every slash of a name.
"""

import zenoh

PUBLISHER = "MP"
_TOKENS = "@ros2_lv/{domain}/*/*/*/MP/*/*/*/*/{dds_type}/*/*"
_TOPIC = 9  # which part of a token


def topics_of_type(session: zenoh.Session, domain: int, dds_type: str, timeout: float) -> list[str]:
    """Return the topics of `dds_type` that somebody publishes, in the order of their names.

    The bridge declares no tokens: its topics are not among them.
    """
    tokens = session.liveliness().get(
        _TOKENS.format(domain=domain, dds_type=dds_type), timeout=timeout
    )
    keys = [str(reply.ok.key_expr) for reply in tokens if reply.ok is not None]
    return sorted({key.split("/")[_TOPIC].replace("%", "/") for key in keys})
