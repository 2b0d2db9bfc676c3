"""Grids as map_server reads them: every mode, either way round, and what is no grid."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from mapweave.errors import FileError
from mapweave.io.grids.map_server import is_grid, read_grid

SETTINGS = "image: map.pgm\nresolution: 0.1\norigin: [-1.0, 2.0, 0.5]\n"
# Row by row from the top: shades, and what each is at the usual thresholds.
SHADES = np.array([[0, 60, 128], [205, 230, 254]], dtype=np.uint8)


def grid(
    folder: Path, more: str, shades: NDArray[np.uint8] = SHADES, name: str = "map.pgm"
) -> Path:
    """Write a picture and its settings; return where these are."""
    Image.fromarray(shades).save(folder / name)
    path = folder / "map.yaml"
    path.write_text(SETTINGS.replace("map.pgm", name) + more)
    return path


def found(path: Path) -> list[str]:
    """Return the cells, rows from the top: a wall #, free ., unknown ?."""
    cells = read_grid(path)
    signs = np.where(cells.wall, "#", np.where(cells.free, ".", "?"))
    return ["".join(row) for row in signs[::-1]]


@pytest.mark.parametrize(
    ("more", "expected"),
    [
        ("occupied_thresh: 0.65\nfree_thresh: 0.196\nnegate: 0\n", ["##?", "?.."]),
        ("occupied_thresh: 0.65\nfree_thresh: 0.25\nnegate: 0\n", ["##?", "..."]),
        ("mode: trinary\nnegate: 1\nfree_thresh: 0.25\n", ["..?", "###"]),
        ("mode: trinary\nnegate: true\nfree_thresh: 0.196\n", [".??", "###"]),
        ("mode: scale\noccupied_thresh: 0.4\nfree_thresh: 0.196\n", ["###", "?.."]),
        # The value of a pixel is the percentage; above 100 it is unknown.
        ("mode: raw\noccupied_thresh: 0.5\nfree_thresh: 0.1\n", [".#?", "???"]),
        ("mode: raw\nnegate: 1\noccupied_thresh: 0.5\nfree_thresh: 0.1\n", [".#?", "???"]),
    ],
)
def test_each_mode_is_read_as_a_map_server_reads_it(
    more: str, expected: list[str], tmp_path: Path
) -> None:
    assert found(grid(tmp_path, more)) == expected


def test_205_is_unknown_in_a_picture_as_savers_write_it_whatever_stands_beside_it(
    tmp_path: Path,
) -> None:
    shades = np.array([[0, 205, 254]], dtype=np.uint8)
    assert found(grid(tmp_path, "free_thresh: 0.25\n", shades)) == ["#?."]


def test_transparent_pixels_are_unknown_where_shades_are_scaled(tmp_path: Path) -> None:
    shades = np.array([[[0, 255], [0, 0], [254, 255], [254, 10]]], dtype=np.uint8)
    picture = Image.merge("LA", [Image.fromarray(shades[..., k].copy()) for k in (0, 1)])
    picture.save(tmp_path / "map.png")
    path = tmp_path / "map.yaml"
    path.write_text(SETTINGS.replace("map.pgm", "map.png") + "mode: scale\n")
    assert found(path) == ["#?.?"]


def test_colours_count_by_their_mean_and_sixteen_bits_as_eight(tmp_path: Path) -> None:
    coloured = np.array([[[0, 0, 30], [255, 255, 230]]], dtype=np.uint8)
    assert found(grid(tmp_path, "", coloured, "map.png")) == ["#."]
    deep = np.array([[0, 40000, 65535]], dtype=np.uint16)
    Image.fromarray(deep).save(tmp_path / "map.png")
    assert found(tmp_path / "map.yaml") == ["#?."]


def test_plain_pictures_and_other_depths_are_read(tmp_path: Path) -> None:
    path = grid(tmp_path, "")
    (tmp_path / "map.pgm").write_text("P2\n# by hand\n3 1\n15\n0 15 7\n")
    assert found(path) == ["#.?"]


@pytest.mark.parametrize("most", [1, 15, 100, 254, 256, 1000, 65535])
@pytest.mark.parametrize("plain", [True, False])
def test_the_greatest_value_of_a_pgm_is_white_whatever_it_is(
    most: int, plain: bool, tmp_path: Path
) -> None:
    """As map_server has it: a pixel's shade is its value as a share of what the picture states."""
    path = grid(tmp_path, "mode: scale\noccupied_thresh: 0.65\nfree_thresh: 0.25\n")
    values = [0, most // 3, most // 2, most - most // 5, most]
    data = (
        " ".join(map(str, values)).encode()
        if plain
        else np.array(values, dtype=np.uint8 if most < 256 else ">u2").tobytes()
    )
    head = f"P{2 if plain else 5}\n5 1\n{most}\n".encode()
    (tmp_path / "map.pgm").write_bytes(head + data)
    expected = ["#" if v / most < 0.35 else "." if v / most > 0.75 else "?" for v in values]
    assert found(path) == ["".join(expected)]


def test_the_frame_is_that_of_the_settings(tmp_path: Path) -> None:
    cells = read_grid(grid(tmp_path, ""))
    assert cells.resolution == 0.1
    assert cells.origin.tolist() == [-1.0, 2.0, 0.5]
    assert cells.wall[1].tolist() == [True, True, False]  # rows upwards


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ("", ["is no list of settings", "expected"]),
        ("- map.pgm\n", ["is no list of settings", "expected"]),
        ("[1, 2", ["is no YAML", "expected"]),
        ("image: map.pgm\norigin: [0, 0, 0]\n", ["resolution", "is missing"]),
        (SETTINGS.replace("0.1", "-1"), ["resolution", "greater"]),
        (SETTINGS.replace("0.1", ".nan"), ["resolution"]),
        (SETTINGS.replace("[-1.0, 2.0, 0.5]", "[1]"), ["origin"]),
        (SETTINGS + "mode: quaternary\n", ["mode", "trinary"]),
        (SETTINGS + "free_thresh: 3\n", ["free_thresh"]),
        (SETTINGS + "free_thresh: 0.7\n", ["free_thresh", "occupied_thresh, 0.65, got 0.7"]),
        ("image: !!python/object:os.system map.pgm\n", ["expected"]),
    ],
)
def test_settings_that_are_none_fail_in_one_line_that_names_them(
    settings: str, words: list[str], tmp_path: Path
) -> None:
    path = grid(tmp_path, "")
    path.write_text(settings)
    with pytest.raises(FileError) as failure:
        read_grid(path)
    assert str(failure.value).startswith(f"{path}: ") and "\n" not in str(failure.value)
    assert all(word in str(failure.value) for word in words)


@pytest.mark.parametrize("content", [b"", b"P5\n3 2\n255\nab", b"GIF89a", b"P5\n0 0\n255\n"])
def test_a_picture_that_is_none_or_cut_off_is_named(content: bytes, tmp_path: Path) -> None:
    path = grid(tmp_path, "")
    (tmp_path / "map.pgm").write_bytes(content)
    with pytest.raises(FileError, match=r"map\.pgm.*expected"):
        read_grid(path)


def test_a_missing_picture_and_one_too_large_are_named(tmp_path: Path) -> None:
    path = grid(tmp_path, "")
    (tmp_path / "map.pgm").write_bytes(b"P5\n80001 1001\n255\n")
    with pytest.raises(FileError, match=r"80001 by 1001 cells; expected no more"):
        read_grid(path)
    (tmp_path / "map.pgm").unlink()
    with pytest.raises(FileError, match=r"map\.pgm: no such file; image of the settings names it"):
        read_grid(path)


@pytest.mark.parametrize(("shade", "word"), [(254, "occupied"), (0, "free")])
def test_a_grid_without_walls_or_without_free_space_is_refused(
    shade: int, word: str, tmp_path: Path
) -> None:
    path = grid(tmp_path, "", np.full((4, 4), shade, dtype=np.uint8))
    with pytest.raises(FileError, match=f"is {word}; expected"):
        read_grid(path)


def test_a_bags_metadata_is_no_grid() -> None:
    assert is_grid(Path("a/map.yaml")) and is_grid(Path("MAP.YML"))
    assert not is_grid(Path("bag/metadata.yaml")) and not is_grid(Path("a.log"))
