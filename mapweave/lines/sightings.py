"""What a map has to explain: samples of all sightings, each with how much was seen there.

A line map is judged by the returns it explains. The returns are gone when maps are merged, but
their sightings stand for them: a segment seen by 30 scans is 30 times its length of wall seen.
"""

from dataclasses import dataclass

import numpy as np

from mapweave.geometry.arrays import BoolArray, FloatArray, IntArray
from mapweave.kernels.lines.evidence import gather, near_pairs
from mapweave.kernels.lines.sampling import sample_parts

DIRECTION_BINS = 24  # of a full turn: sightings 15° apart are gathered


@dataclass(frozen=True, slots=True, eq=False)
class Sightings:
    """Samples of sightings in one frame.

    Attributes
    ----------
    points
        (n, 2) [m].
    directions
        (n, 2) unit vectors along the sighting, its visible side on the left.
    weights
        (n,) the wall seen there [m], counted as often as it was seen.
    spacing
        [m] along a sighting that a sample stands for at most.
    """

    points: FloatArray
    directions: FloatArray
    weights: FloatArray
    spacing: float

    def __len__(self) -> int:
        """Return the number of samples."""
        return len(self.points)

    @classmethod
    def of(cls, segments: FloatArray, counts: FloatArray | IntArray, spacing: float) -> "Sightings":
        """Sample sightings.

        Parameters
        ----------
        segments
            (n, 4) x1 y1 x2 y2 [m], the visible side on the left.
        counts
            (n,) how often each was seen.
        spacing
            [m] between samples at most.
        """
        samples = sample_parts(segments, spacing)
        weights = np.asarray(counts[samples.owner] * samples.lengths, dtype=np.float64)
        return cls(samples.points, samples.directions, weights, spacing)

    def gathered(self) -> "Sightings":
        """Return the same evidence in fewer samples: the mean of those that hardly differ."""
        points, directions, weights = gather(
            self.points, self.directions, self.weights, self.spacing / 2, DIRECTION_BINS
        )
        return Sightings(points, directions, weights, self.spacing)

    def those(self, kept: BoolArray) -> "Sightings":
        """Return the samples that are `kept` (n,)."""
        return Sightings(self.points[kept], self.directions[kept], self.weights[kept], self.spacing)


@dataclass(frozen=True, slots=True, eq=False)
class Nearness:
    """Which samples are near which segments, and how they lie to them; k pairs.

    Attributes
    ----------
    segment, sample
        (k,) indices.
    along, across
        (k,) the sample's place along the segment from its start, and to its left [m].
    distance
        (k,) from the segment [m].
    cosine
        (k,) of the angle between both directions: 1 for the same face, -1 for the opposite one.
    """

    segment: IntArray
    sample: IntArray
    along: FloatArray
    across: FloatArray
    distance: FloatArray
    cosine: FloatArray

    @classmethod
    def of(
        cls, segments: FloatArray, points: FloatArray, directions: FloatArray, reach: float
    ) -> "Nearness":
        """Pair segments with the points close to them.

        Parameters
        ----------
        segments
            (n, 4) x1 y1 x2 y2 [m].
        points, directions
            (m, 2) [m], the same frame, and unit vectors.
        reach
            [m] from a segment at most.
        """
        return cls(*near_pairs(segments, points, directions, reach))

    def of_segments(self, chosen: IntArray) -> "Nearness":
        """Return the pairs of the (n,) `chosen` segments, which are numbered in that order."""
        first, last = (np.searchsorted(self.segment, chosen, side) for side in ("left", "right"))
        counts = last - first
        within = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
        pairs = np.repeat(first, counts) + within
        return Nearness(
            np.repeat(np.arange(len(chosen)), counts),
            self.sample[pairs],
            self.along[pairs],
            self.across[pairs],
            self.distance[pairs],
            self.cosine[pairs],
        )

    def followed_by(self, others: "Nearness", count: int) -> "Nearness":
        """Return these pairs, of `count` segments, and those of others that are numbered on."""
        return Nearness(
            np.concatenate([self.segment, others.segment + count]),
            np.concatenate([self.sample, others.sample]),
            np.concatenate([self.along, others.along]),
            np.concatenate([self.across, others.across]),
            np.concatenate([self.distance, others.distance]),
            np.concatenate([self.cosine, others.cosine]),
        )
