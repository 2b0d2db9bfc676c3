"""Grids of ROS's map_server: a ``.yaml`` that names a picture beside it, read as Nav2 reads them.

A picture's shade tells how surely a cell is occupied; `mode` how, `negate` which way round.
"""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    ValidationError,
    ValidationInfo,
    field_validator,
)

from mapweave.errors import FileError, MissingExtraError
from mapweave.geometry.arrays import BoolArray, FloatArray
from mapweave.mapping.grids.cells import GridCells
from mapweave.text import in_words

if TYPE_CHECKING:
    from PIL.Image import Image

SUFFIXES = (".yaml", ".yml")
PICTURES = (".pgm", ".png")
BAG_METADATA = "metadata.yaml"
MOST_CELLS = 80_000_000
UNKNOWN_SHADE = 205  # as map savers write it
_EXPECTED = "expected the settings of a map_server grid: image, resolution, origin, …"
_Share = Annotated[float, Field(ge=0, le=1)]
_Finite = Annotated[float, Field(ge=-1e6, le=1e6)]


class _Settings(BaseModel):
    model_config = ConfigDict(frozen=True, extra="ignore", allow_inf_nan=False)

    image: str = Field(min_length=1)
    resolution: float = Field(ge=0.001, le=10)
    origin: Annotated[list[_Finite], Field(min_length=2, max_length=3)]
    mode: Literal["trinary", "scale", "raw"] = "trinary"
    negate: bool = False
    occupied_thresh: _Share = 0.65
    free_thresh: _Share = 0.25

    @field_validator("free_thresh")
    @classmethod
    def _check_order(cls, value: float, known: ValidationInfo) -> float:
        occupied = known.data.get("occupied_thresh", 1.0)
        if value > occupied:
            raise ValueError(f"expected no more than occupied_thresh, {occupied}, got {value}")
        return value


def is_grid(path: Path) -> bool:
    """Whether `path` is called as such settings are; a bag's metadata is none."""
    return path.suffix.lower() in SUFFIXES and path.name != BAG_METADATA


def check_no_picture(path: Path) -> None:
    """Raise FileError if `path` is the picture of such a grid, and not its settings."""
    if path.suffix.lower() not in PICTURES or not path.exists():
        return
    beside = [path.with_suffix(suffix) for suffix in SUFFIXES]
    there = next((str(settings) for settings in beside if settings.exists()), "its .yaml")
    raise FileError(path, f"is the picture of a grid; expected {there}, which says how to read it")


def read_grid(path: Path) -> GridCells:
    """Return the grid whose settings are at `path`.

    Raises
    ------
    FileError
        If they, or the picture that they name, are not such, or it has no free cell or no wall.
    MissingExtraError
        If what reads YAML and pictures is not installed.
    """
    settings = _settings(path)
    picture = path.parent / settings.image
    shade, opaque = _shades(picture)
    wall, free = _meaning(shade, opaque, settings)
    for found, what in ((wall, "occupied"), (free, "free")):
        if not found.any():
            raise FileError(path, f"no cell of {picture} is {what}; expected walls and free space")
    origin = np.array([*settings.origin, 0.0][:3])
    return GridCells(wall[::-1], free[::-1], settings.resolution, origin)


def _settings(path: Path) -> _Settings:
    try:
        from ruamel.yaml import YAML
        from ruamel.yaml.error import YAMLError
    except ImportError as error:
        raise MissingExtraError("a map_server grid", "grids") from error
    try:
        content = YAML(typ="safe", pure=True).load(path.read_text(encoding="utf-8"))
        if not isinstance(content, dict):
            raise FileError(path, f"is no list of settings; {_EXPECTED}")
        return _Settings.model_validate(content)
    except OSError as error:
        raise FileError(path, f"cannot be read ({error.strerror}); {_EXPECTED}") from error
    except (YAMLError, UnicodeDecodeError) as error:
        raise FileError(path, f"is no YAML; {_EXPECTED}") from error
    except ValidationError as error:
        problem = error.errors(include_url=False, include_context=False)[0]
        place = ".".join(map(str, problem["loc"]))
        words = f"{place}: {in_words(problem)}" if place else in_words(problem)
        raise FileError(path, f"{words}; {_EXPECTED}") from error


def _shades(path: Path) -> tuple[FloatArray, BoolArray]:
    """Return (rows, columns) shades from 0, black, to 1, white, and which pixels are opaque."""
    try:
        from PIL import Image, UnidentifiedImageError
    except ImportError as error:
        raise MissingExtraError("a map_server grid", "grids") from error
    try:
        with Image.open(path) as image:
            if image.width * image.height > MOST_CELLS:
                raise FileError(
                    path,
                    f"has {image.width} by {image.height} cells; expected no more than"
                    f" {MOST_CELLS} cells",
                )
            return _pixels(image)
    except FileNotFoundError as error:
        raise FileError(path, "no such file; image of the settings names it") from error
    except (OSError, UnidentifiedImageError, SyntaxError, ValueError) as error:
        raise FileError(
            path, "is no picture, or cut off; expected PGM, PNG or another of a grid"
        ) from error


def _pixels(image: "Image") -> tuple[FloatArray, BoolArray]:
    if image.mode.startswith("I"):  # 16 bits
        deep = np.asarray(image, dtype=np.float64) / 65535
        return deep, np.ones(deep.shape, dtype=np.bool_)
    has_alpha = image.mode in ("LA", "RGBA", "PA") or "transparency" in image.info
    pixels = np.asarray(image.convert("RGBA" if has_alpha else "RGB"), dtype=np.float64)
    opaque = pixels[..., 3] == 255 if has_alpha else np.ones(pixels.shape[:2], dtype=np.bool_)
    return pixels[..., :3].mean(axis=-1) / 255, opaque


def _meaning(
    shade: FloatArray, opaque: BoolArray, settings: _Settings
) -> tuple[BoolArray, BoolArray]:
    """Return which pixels are walls, and which are free."""
    occupancy = shade if settings.negate else 1.0 - shade
    if settings.mode == "raw":  # percent in the pixel's value, whatever `negate` says
        percent: NDArray[np.float64] = np.round(shade * 255)
        known, occupancy = percent <= 100, percent / 100
    else:
        known = _known(shade, opaque, settings)
    wall = known & (occupancy > settings.occupied_thresh)
    return np.asarray(wall), np.asarray(known & (occupancy < settings.free_thresh))


def _known(shade: FloatArray, opaque: BoolArray, settings: _Settings) -> BoolArray:
    """Return which pixels say something.

    In a picture of three shades, as savers write it, 205 means unknown, though with the threshold
    of 0.25 that they write beside it map_server itself takes it to be free.
    """
    if settings.mode == "scale":
        return opaque
    values = np.round(shade * 255)
    saved = len(np.unique(values)) <= 3
    return np.asarray(~(saved & (values == UNKNOWN_SHADE)))
