"""How far each test is from what changed, counted in imports.

Read from the sources alone: nothing is imported, and imports inside functions or for type
checking count like others.
"""

import ast
import tomllib
from collections import deque
from collections.abc import Collection, Iterator, Mapping
from importlib.util import resolve_name
from pathlib import Path, PurePosixPath


def package_roots(root: Path) -> list[str]:
    """Return the folders of the checkout at `root` that modules are imported from."""
    content = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))
    packages = content["tool"]["scikit-build"]["wheel"]["packages"]
    return [".", *sorted({str(PurePosixPath(package).parent) for package in packages} - {"."})]


def module_name(file: str, roots: Collection[str]) -> str:
    """Return the name that `file`, relative to the checkout, is imported by."""
    path = PurePosixPath(file).with_suffix("")
    above = [PurePosixPath(root) for root in roots if path.is_relative_to(root)]
    below = path.relative_to(max(above, key=lambda root: len(root.parts)))
    return ".".join(below.parts).removesuffix(".__init__")


def imported_names(source: str, package: str) -> Iterator[str]:
    """Yield each name that may be a module among what `source`, of `package`, imports."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            module = resolve_name("." * node.level + (node.module or ""), package)
            yield module
            yield from (f"{module}.{alias.name}" for alias in node.names)


def import_graph(root: Path, files: Collection[str]) -> dict[str, set[str]]:
    """Return by file which of `files` it needs: those it imports, and conftests above it."""
    roots = package_roots(root)
    file_of = {module_name(file, roots): file for file in files}
    graph = {}
    for name, file in file_of.items():
        package = name if file.endswith("__init__.py") else name.rpartition(".")[0]
        source = (root / file).read_text(encoding="utf-8")
        names = imported_names(source, package)
        above = {f"{folder}/conftest.py" for folder in PurePosixPath(file).parents}
        graph[file] = {file_of[name] for name in names if name in file_of} | (above & set(files))
    return graph


def distances(graph: Mapping[str, Collection[str]], changed: Collection[str]) -> dict[str, int]:
    """Return how many imports lie between each file and the nearest of `changed` that it needs.

    Files that need none of them are left out; the changed ones are at 0.
    """
    importers: dict[str, list[str]] = {file: [] for file in graph}
    for file, needed in graph.items():
        for other in needed:
            importers[other].append(file)
    found = {file: 0 for file in changed if file in graph}
    waiting = deque(found)
    while waiting:
        file = waiting.popleft()
        for importer in importers[file]:
            if importer not in found:
                found[importer] = found[file] + 1
                waiting.append(importer)
    return found


def room_of_tests(module: str) -> str:
    """Return the folder of the tests of `module`: ``mapweave_agent.agent`` has ``tests/agent``."""
    *rooms, _ = module.removeprefix("mapweave_").split(".")
    return "/".join(["tests", *rooms])


def distances_of_tests(
    root: Path, files: Collection[str], changed: Collection[str]
) -> dict[str, int]:
    """Return the distance of each test file that has to do with `changed`.

    A test is as near as its imports say; it is at 1 if it lies in the room of a changed module,
    which commands and processes reach without an import, or if it names a changed file that is
    no module, such as ``README.md``.
    """
    sources = [file for file in files if file.endswith(".py")]
    roots = package_roots(root)
    near = distances(import_graph(root, sources), changed)
    rooms = {room_of_tests(module_name(file, roots)) for file in changed if file.endswith(".py")}
    others = {PurePosixPath(file).name for file in changed if not file.endswith(".py")}
    for test in filter(is_test, sources):
        source = (root / test).read_text(encoding="utf-8")
        if str(PurePosixPath(test).parent) in rooms or any(name in source for name in others):
            near[test] = min(near.get(test, 1), 1)
    return {file: near[file] for file in near if is_test(file)}


def is_test(file: str) -> bool:
    """Return whether pytest finds tests in `file`."""
    path = PurePosixPath(file)
    return path.parts[0] == "tests" and path.match("test_*.py")
