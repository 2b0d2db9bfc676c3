"""Tables as text, and results as files."""

import json
from collections.abc import Sequence
from pathlib import Path

OUTPUT = Path("bench")


def format_table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table; its first column is flush left, the others flush right."""
    lines = [list(head), *map(list, rows)]
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    return "\n".join(
        "  ".join(
            cell.ljust(width) if k == 0 else cell.rjust(width)
            for k, (cell, width) in enumerate(zip(line, widths, strict=True))
        ).rstrip()
        for line in lines
    )


def write_json(file: Path, content: object) -> None:
    """Write `content` to `file`, its folder made when there is none."""
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(json.dumps(content, indent=1) + "\n")
