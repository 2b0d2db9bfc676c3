"""Nobody has to search: no folder is crowded."""

from collections import Counter
from pathlib import Path

ROOT = Path(__file__).parents[1]
PACKAGES = ("mapweave", "protocol", "ros", "agent", "fusion_server", "deploy", "tools")
MOST = 16


def test_no_folder_has_more_than_sixteen_modules() -> None:
    modules = [file for package in PACKAGES for file in (ROOT / package).rglob("*.py")]
    counts = Counter(file.parent for file in modules if file.name != "__init__.py")
    assert len(counts) > len(PACKAGES)
    assert {str(folder): n for folder, n in counts.items() if n > MOST} == {}
