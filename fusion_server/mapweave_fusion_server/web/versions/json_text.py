"""What the page is told, as bytes."""

import json


def to_json(content: object) -> bytes:
    """Return `content` as JSON; angle brackets cannot end a script that it might come into."""
    text = json.dumps(content, separators=(",", ":"), allow_nan=False)
    return text.replace("<", "\\u003c").encode()
