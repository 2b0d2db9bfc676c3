"""The directive ``room``: all modules of a package, and what the parameters of each stage mean."""

import importlib
import inspect
import pkgutil
from collections.abc import Iterator
from itertools import takewhile

from docutils import nodes
from pydantic import BaseModel
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

ARRAYS = {
    "ndarray[tuple[Any, ...], dtype[float64]]": "FloatArray",
    "ndarray[tuple[Any, ...], dtype[float32]]": "Float32Array",
    "ndarray[tuple[Any, ...], dtype[int64]]": "IntArray",
    "ndarray[tuple[Any, ...], dtype[bool]]": "BoolArray",
    "ndarray[tuple[Any, ...], dtype[complex128]]": "ComplexArray",
}

WITHOUT = "   :exclude-members: model_config\n"  # pydantic's own


class Room(SphinxDirective):
    """Shows a package and its modules, each under a heading of its own.

    ``.. room:: mapweave.lines``
    """

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Return what autodoc says of the package, and of each module that has no folder."""
        parts = [_automodule(self.arguments[0])]
        for name in _modules(self.arguments[0]):
            heading = f"``{name}``"
            parts.append(f"{heading}\n{'-' * len(heading)}\n\n{_automodule(name)}")
        return self.parse_text_to_nodes("\n\n".join(parts), allow_section_headings=True)


def _automodule(name: str) -> str:
    return f".. automodule:: {name}\n   :members:\n   :ignore-module-all:\n{WITHOUT}"


def _modules(package: str) -> Iterator[str]:
    """Yield the names of the modules of `package`, and of the packages in it."""
    path = importlib.import_module(package).__path__
    for found in pkgutil.iter_modules(path, f"{package}."):
        yield found.name
        if found.ispkg:
            yield from _modules(found.name)


def _tell_parameters(
    app: Sphinx, what: str, name: str, thing: object, options: object, lines: list[str]
) -> None:
    """Add to the docstring of a stage's parameters what each is, and by default."""
    del app, what, name, options
    if not (inspect.isclass(thing) and issubclass(thing, BaseModel)):
        return
    fields = thing.model_fields.items()
    told = [(key, field) for key, field in fields if field.description]
    if told:
        lines += ["", "Fields:", ""]
    for key, field in told:
        default = "" if field.is_required() else f" = {_value(field.default)}"
        lines += [f"- ``{key}{default}``: {field.description}"]


def _value(default: object) -> str:
    """Return a default as a person would write it."""
    return f"{default:.4g}" if isinstance(default, float) else repr(default)


def _tell_apart(
    app: Sphinx, what: str, name: str, thing: object, options: object, lines: list[str]
) -> None:
    """Give each attribute of a line such as ``low, high`` an entry of its own, as napoleon asks."""
    del app, what, name, thing, options
    told: list[str] = []
    for number, line in enumerate(lines):
        names = line.split(", ")
        told_together = len(names) > 1 and all(each.isidentifier() for each in names)
        if told_together and _is_told(lines, number):
            said = list(takewhile(lambda each: each.startswith(" "), lines[number + 1 :]))
            told += [text for each in names[:-1] for text in (each, *said)]
            told.append(names[-1])
        else:
            told.append(line)
    lines[:] = told


def _is_told(lines: list[str], number: int) -> bool:
    """Whether what follows line `number` is set in: a description."""
    return number + 1 < len(lines) and lines[number + 1].startswith(" ")


def _shorten(
    app: Sphinx,
    what: str,
    name: str,
    thing: object,
    options: object,
    signature: str | None,
    returns: str | None,
) -> tuple[str, str | None] | None:
    """Call arrays by the names that the code gives their types."""
    del app, name, options
    if signature is None:
        return None
    if what == "class" and inspect.isclass(thing) and issubclass(thing, BaseModel):
        return "(…)", None  # its fields are told one by one
    return _in_short(signature), None if returns is None else _in_short(returns)


def _in_short(annotations: str) -> str:
    """Return annotations without the modules of numpy and typing, arrays by their names."""
    for module in ("~numpy.", "~typing.", "numpy.", "typing."):
        annotations = annotations.replace(module, "")
    for long, short in ARRAYS.items():
        annotations = annotations.replace(long, short)
    return annotations


def setup(app: Sphinx) -> dict[str, bool]:
    """Make the directive known to Sphinx."""
    app.add_directive("room", Room)
    app.connect("autodoc-process-docstring", _tell_parameters)
    app.connect("autodoc-process-docstring", _tell_apart, priority=400)  # before napoleon
    app.connect("autodoc-process-signature", _shorten)
    return {"parallel_read_safe": True}
