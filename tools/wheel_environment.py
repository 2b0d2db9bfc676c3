"""``python -m tools.wheel_environment FOLDER``: an environment that has mapweave as users get it.

It holds the wheel in ``dist/``, compiled for its Python, its dependencies, and what the tests need.
The checkout comes last on its path: tests and benchmarks are found there, mapweave is not.
"""

import argparse
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from hashlib import sha256
from pathlib import Path

from packaging.requirements import Requirement

ROOT = Path(__file__).parents[1]
FIND_TAG = "import sys; print('cp%d%d' % sys.version_info[:2])"
FIND_SITE = "import sysconfig; print(sysconfig.get_path('purelib'))"


def main() -> None:
    """Make the environment that the command line asks for."""
    parser = argparse.ArgumentParser(prog="python -m tools.wheel_environment")
    parser.add_argument("folder", type=Path)
    parser.add_argument("--lowest", action="store_true", help="the lowest versions promised")
    options = parser.parse_args()
    make_environment(options.folder, sys.executable, lowest=options.lowest)


def make_environment(folder: Path, python: str, *, lowest: bool = False) -> Path:
    """Make or renew the environment in `folder` and return its interpreter.

    Its dependencies are installed anew only when ``pyproject.toml`` or `python` changed.

    Parameters
    ----------
    python
        The interpreter it is made with.
    lowest
        Whether the direct dependencies are the lowest that ``pyproject.toml`` promises, not the
        newest there are.

    Raises
    ------
    SystemExit
        If there is not one wheel in ``dist/``, nor one source to make it of, or it cannot be
        installed.
    """
    wheel = _built_wheel(python)
    inside, stamp = folder / "bin" / "python", folder / ".made-of"
    made_of = sha256((ROOT / "pyproject.toml").read_bytes() + python.encode()).hexdigest()
    if not stamp.is_file() or stamp.read_text() != made_of:
        _run(python, "-m", "venv", "--clear", str(folder))
        _pip(inside, f"{wheel}[test]", *(lowest_versions() if lowest else ()))
        _append_checkout(inside)
        stamp.write_text(made_of)
    _pip(inside, "--force-reinstall", "--no-deps", str(wheel))
    return inside


def lowest_versions() -> Iterator[str]:
    """Yield a requirement of exactly the lowest version for each that ``pyproject.toml`` promises.

    Those of a program's users are meant, with pictures; what tests need is not.
    """
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    for line in (*project["dependencies"], *project["optional-dependencies"]["plot"]):
        requirement = Requirement(line)
        floors = [each.version for each in requirement.specifier if each.operator == ">="]
        if len(floors) != 1:
            raise SystemExit(f"pyproject.toml: {line}: expected one lowest version, as >=1.2")
        yield f"{requirement.name}=={floors[0]}"


def _built_wheel(python: str) -> Path:
    """Return the wheel in ``dist/`` that `python` takes; one of another Python is compiled anew."""
    told = subprocess.run([python, "-c", FIND_TAG], capture_output=True, text=True, check=True)
    dist, tag = ROOT / "dist", told.stdout.strip()
    sources = list(dist.glob("*.tar.gz"))
    if not fitting_wheels(dist, tag) and len(sources) == 1:
        compile_it = ("-m", "pip", "wheel", "--quiet", "--no-deps", "--wheel-dir", str(dist))
        _run(python, *compile_it, str(sources[0]))
    wheels = fitting_wheels(dist, tag)
    if len(wheels) != 1:
        raise SystemExit(f"dist/ has {len(wheels)} wheels of {tag}, expected one: run make wheel")
    return wheels[0]


def fitting_wheels(folder: Path, tag: str) -> list[Path]:
    """Return the wheels in `folder` for a Python, such as ``cp312``: its own, or any Python's."""
    return [*folder.glob(f"*-{tag}-*.whl"), *folder.glob("*-py3-*.whl")]


def _append_checkout(python: Path) -> None:
    site = subprocess.run(
        [python, "-c", FIND_SITE], capture_output=True, text=True, check=True
    ).stdout.strip()
    Path(site, "checkout.pth").write_text(f"{ROOT}\n")


def _pip(python: Path, *arguments: str) -> None:
    _run(str(python), "-m", "pip", "install", "--quiet", "--disable-pip-version-check", *arguments)


def _run(*command: str) -> None:
    if subprocess.run(command, check=False).returncode != 0:
        raise SystemExit(f"failed: {' '.join(command)}")


if __name__ == "__main__":
    main()
