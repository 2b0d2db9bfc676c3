"""What became of an order, for a person or a program."""

import argparse

from mapweave.cli import say
from mapweave_protocol.wire.messages import OrderMessage


def tell(options: argparse.Namespace, order: OrderMessage, sentence: str, **about: object) -> None:
    """Tell of an order that was taken, or of one that takes another back.

    Parameters
    ----------
    sentence
        What was done, in words.
    about
        The same as values.
    """
    content = {
        "order": order.takes_back or order.id,
        "kind": order.kind.value,
        "taken_back": order.takes_back is not None,
        "by": order.by,
        "time": order.time,
        "reason": order.reason,
        **about,
    }
    say(options, content, [f"{sentence}, order {content['order']}"])
