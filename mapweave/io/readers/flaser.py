"""The beams of a ``FLASER``, which states only how many there are.

What is known of them comes, in this order, from the user, from the log's own parameters, and from
the number, which often tells the scanner.
"""

import math
from typing import NamedTuple

from mapweave.io.readers.beams import DEGREE, Beams, DamagedLineError, beam_angles, even_beams

_TURN = 2 * math.pi
_FIELD, _RESOLUTION = b"laser_front_laser_fov", b"laser_front_laser_resolution"

_SICK = {
    180: 1.0 * DEGREE,
    181: 1.0 * DEGREE,
    360: 0.5 * DEGREE,
    361: 0.5 * DEGREE,
    400: 0.25 * DEGREE,
    401: 0.25 * DEGREE,
}
"""[rad] The modes of the SICK LMS by the number of beams; 400 and 401 look over the front 100°."""


class _Scanner(NamedTuple):
    """A scanner that is known by its number of beams.

    Attributes
    ----------
    name
        For a person: the field of view, and whose it is.
    step
        Between beams [°].
    before
        How many beams look to the right of straight ahead.
    """

    name: str
    step: float
    before: int


_WIDE = "270° (SICK LMS1xx and TiM, Hokuyo UTM-30LX and UST)"
_URG = "240° (Hokuyo URG-04LX)"
_SCANNERS = {
    271: _Scanner(_WIDE, 1.0, 135),
    541: _Scanner(_WIDE, 0.5, 270),
    681: _Scanner(_URG, 360 / 1024, 340),
    682: _Scanner(_URG, 360 / 1024, 340),
    683: _Scanner(_URG, 360 / 1024, 340),
    721: _Scanner("180°, as FLASER has it unless a log says otherwise,", 0.25, 360),
    726: _Scanner("255°, -135° to 120° (Hokuyo URG-04LX from its first step on)", 360 / 1024, 384),
    769: _Scanner("270° (Hokuyo UHG-08LX, URG-04LX)", 360 / 1024, 384),
    1081: _Scanner(_WIDE, 0.25, 540),
    1440: _Scanner("a full turn, from behind", 0.25, 720),
}
"""Numbers of beams that no SICK LMS has. A URG counts 1024 steps a turn, 384 of them from its first
one to straight ahead; it measures from step 44 to 725."""

_WAY_OUT = f"set [sensor] angular_step, or state PARAM {_FIELD.decode()}, if they look elsewhere"

_LEAST_VIEW = 2 * math.pi
"""[°] A turn in radians. No scanner sees as little as that in degrees: it is stated in radians."""

_COARSEST = 0.1
"""[rad] Of resolutions that are taken for radians."""


_ROUNDED = 0.03
"""Of a step, by which a stated one may differ: a URG's 0.3516° is written as 0.35 and as 0.36."""


class FlaserBeams:
    """Where the beams of the ``FLASER`` lines of one log look.

    Parameters
    ----------
    step
        Between beams [rad], where the user knows it: goes before all that the log says.
    """

    def __init__(self, step: float | None = None) -> None:
        self._step = step
        self._stated: dict[bytes, float] = {}
        self._ignored = ""
        self._known: dict[int, Beams] = {}

    def note(self, words: list[bytes]) -> None:
        """Take up the words of a ``PARAM``, if it says anything of the beams."""
        if len(words) < 3 or words[1] not in (_FIELD, _RESOLUTION):
            return
        value = _number(words[2])
        if 0 < abs(value) <= 360:  # False for NaN
            self._stated[words[1]], self._ignored = value, ""
        else:
            self._stated.pop(words[1], None)
            self._ignored = f"PARAM {words[1].decode()} is no angle in degrees and is ignored"
        self._known.clear()

    def of(self, count: int) -> Beams:
        """Return the beams of a line with ``count`` of them.

        Raises
        ------
        DamagedLineError
            If there are fewer than two, or if they go round more than once.
        """
        if count < 2:
            raise DamagedLineError(f"FLASER has {count} beams, expected two or more")
        if count not in self._known:
            if len(self._known) >= 16:  # a log of many scanners is no log
                self._known.clear()
            self._known[count] = self._find(count)
        return self._known[count]

    def _find(self, count: int) -> Beams:
        if self._step is not None:
            return Beams(beam_angles(-(count - 1) * self._step / 2, self._step, count))
        beams = self._of_parameters(count) if self._stated else _of_number(count)
        both = "; ".join(filter(None, (self._ignored, beams.assumed)))
        return beams._replace(assumed=both)

    def _of_parameters(self, count: int) -> Beams:
        """Return the beams as the log's parameters have them."""
        field, step, assumed = self._field_and_step(count)
        if _is_of_number(count, field, step):  # a known scanner: it knows its first beam, too
            return _of_number(count)._replace(assumed=assumed)
        size = abs(step) if step else _step_over(field, count)
        if not _fits(count, size, field):
            assumed = f"PARAM {_RESOLUTION.decode()} does not fit {count} beams and is ignored"
            if not field:
                beams = _of_number(count)
                return beams._replace(assumed="; ".join(filter(None, (assumed, beams.assumed))))
            size = _step_over(field, count)
        # Where the field of view, or a turn, has room for one beam more, the last was left out.
        opened = abs(count * size - (field or _TURN)) < size / 2
        start = -(count if opened else count - 1) * size / 2
        sign = -1 if step is not None and step < 0 else 1
        return even_beams(sign * start, sign * size, count, assumed)

    def _field_and_step(self, count: int) -> tuple[float, float | None, str]:
        """Return the field of view (0: not stated) and the step [rad], and what was assumed."""
        field, step = self._stated.get(_FIELD, 0.0), self._stated.get(_RESOLUTION)
        view = abs(field) or (count - 1) * abs(step or 0)
        radians = view <= _LEAST_VIEW and abs(step or 0) <= _COARSEST
        unit = 1.0 if radians else DEGREE
        assumed = f"PARAM {_FIELD.decode()} and the like are radians" if radians else ""
        return abs(field) * unit, None if step is None else step * unit, assumed


def _of_number(count: int) -> Beams:
    """Return the beams of which nothing is known but how many they are."""
    if count in _SCANNERS:
        name, step, before = _SCANNERS[count]
        assumed = (
            f"the {count} beams of a FLASER look over {name} in steps of {step:.4g}°: {_WAY_OUT}"
        )
        return even_beams(-before * step * DEGREE, step * DEGREE, count, assumed)
    resolution = _SICK.get(count, math.pi / (count - 1))
    # 180 and 360 beams are 181 and 361 whose last one, at +90°, was not sent.
    start = -math.pi / 2 if count in (180, 360) else -(count - 1) * resolution / 2
    return Beams(beam_angles(start, resolution, count))


def _is_of_number(count: int, field: float, step: float | None) -> bool:
    """Return whether the number of beams tells a scanner that agrees with what is stated."""
    known = _SICK.get(count) or (_SCANNERS[count].step * DEGREE if count in _SCANNERS else 0.0)
    if not known:
        return False
    if step is not None:
        return abs(step - known) <= _ROUNDED * known
    return abs(field - (count - 1) * known) <= 2 * known


def _fits(count: int, step: float, field: float) -> bool:
    """Return whether beams `step` [rad] apart fill `field` [rad], or a turn if it is 0."""
    span = (count - 1) * step
    return -step <= field - span <= 2 * step if field else span <= _TURN + step


def _step_over(field: float, count: int) -> float:
    """Return the step [rad] of beams over `field` [rad]; over a turn an even number is open."""
    whole_turn = field > 0.999 * _TURN
    return field / (count if whole_turn and count % 2 == 0 else count - 1)


def _number(word: bytes) -> float:
    try:
        return float(word)
    except ValueError:
        return math.nan
