"""A copy of the code and its tests, in which code may be wrong without harm."""

import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from benchmarks.mutation_entries import Mutation
from mapweave.kernels.loading import PURE
from tests.conftest import DATA
from tools.imports import package_roots

ROOT = Path(__file__).parents[1]
MADE = {"bench", "demo", "team", "site", "dist"}  # folders at the root that are no code
KERNELS = Path("mapweave/kernels")
BUILT = Path(".kernels")  # where they are compiled
FIRST = Path(".first")  # what is imported at the start, before anything else
# An editable installation of scikit-build-core comes before PYTHONPATH, unless it is taken out.
FORGET_THE_INSTALLED = """\
import sys

sys.meta_path[:] = [f for f in sys.meta_path if not type(f).__module__.startswith("_editable")]
"""


class Tree:
    """A copy of the code and its tests, in which both are imported from the copy.

    Its kernels are the NumPy twins until `compile` was called.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        shutil.copytree(ROOT, folder, ignore=_left_out)
        (folder / FIRST).mkdir()
        (folder / FIRST / "sitecustomize.py").write_text(FORGET_THE_INSTALLED)
        self._environment = {
            "MAPWEAVE_DATA": str(DATA),
            **os.environ,
            # Before what is installed; without byte code, which may look as new as a changed file.
            "PYTHONPATH": os.pathsep.join(
                str(folder / root) for root in [str(FIRST), *package_roots(folder)]
            ),
            "PYTHONDONTWRITEBYTECODE": "1",
            "OMP_NUM_THREADS": "1",
            "OPENBLAS_NUM_THREADS": "1",
        }

    def compile(self) -> Path:
        """Compile the kernels of this copy, what changed since the last time; return the module.

        The program ends where they cannot be compiled.
        """
        built = self.folder / BUILT
        if not built.exists():
            self._run_cmake("-S", str(self.folder / KERNELS), "-B", str(built), *_how_to_compile())
        self._run_cmake("--build", str(built))
        (module,) = built.glob("_compiled*.so")
        used = self.folder / KERNELS / module.name
        shutil.copyfile(module, used)
        return used

    def test(
        self, guards: Sequence[str], patience: float, *, pure: bool = False
    ) -> tuple[int | None, str]:
        """Run tests until one fails; return what pytest ended with, None out of time, and said.

        Parameters
        ----------
        guards
            The tests, as pytest names them.
        patience
            How long they may take [s].
        pure
            Whether the NumPy twins are tested, where kernels were compiled.
        """
        command = [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", *guards]
        process = subprocess.Popen(
            command,
            cwd=self.folder,
            env={**self._environment, PURE: "1" if pure else "0"},
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            start_new_session=True,
        )
        try:
            said, _ = process.communicate(timeout=patience)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            said, _ = process.communicate()
            return None, said
        return process.returncode, said

    def test_wrong(self, mutation: Mutation, patience: float) -> dict[str, tuple[int | None, str]]:
        """Make the code wrong, run the tests that guard it, and make it right again.

        A rule with a kernel is made wrong in both, and tested with the twin and with the kernel.
        Returns what `test` does for each of these.
        """
        ended = {}
        compiled = {path: path.read_bytes() for path in (self.folder / KERNELS).glob("*.so")}
        right = mutation.apply(self.folder)
        try:
            if mutation.kernel:
                ended["the twin"] = self.test(mutation.guards, patience, pure=True)
                self.compile()
            ended["the kernel" if mutation.kernel else "the code"] = self.test(
                mutation.guards, patience
            )
        finally:
            for file, text in right.items():
                (self.folder / file).write_text(text)
            for path, module in compiled.items():
                path.write_bytes(module)
        return ended

    def _run_cmake(self, *arguments: str) -> None:
        done = subprocess.run(
            ["cmake", *arguments], capture_output=True, text=True, env=_with_own_programs()
        )
        if done.returncode:
            sys.exit(f"the kernels cannot be compiled\n{done.stdout}{done.stderr}")


def _how_to_compile() -> list[str]:
    """Return cmake's options: as when installed, but for what takes time and changes no result."""
    nanobind = subprocess.check_output(
        [sys.executable, "-m", "nanobind", "--cmake_dir"], text=True
    ).strip()
    return [
        "-GNinja",
        f"-DPython_EXECUTABLE={sys.executable}",
        f"-Dnanobind_DIR={nanobind}",
        "-DCMAKE_BUILD_TYPE=Debug",
        "-DCMAKE_CXX_FLAGS_DEBUG=",
    ]


def _with_own_programs() -> dict[str, str]:
    """Return an environment in which programs installed beside Python are found first."""
    own = str(Path(sys.executable).parent)
    return {**os.environ, "PATH": os.pathsep.join([own, os.environ.get("PATH", os.defpath)])}


def _left_out(folder: str, names: list[str]) -> set[str]:
    """Return which `names` in `folder` are not copied: hidden ones, byte code, what was made."""
    made = MADE if Path(folder) == ROOT else set()
    return {name for name in names if name.startswith((".", "__pycache__"))} | made
