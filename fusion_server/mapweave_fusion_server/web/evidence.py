"""What two parts share at an alignment and where they contradict each other, as places to show.

The rules are those by which the alignment was decided (`mapweave.matching.verification`).
"""

from typing import Any

from mapweave.config import Config
from mapweave.geometry import se2
from mapweave.geometry.arrays import FloatArray
from mapweave.maps import Alignment, LineMap
from mapweave.matching.distance_field import DistanceField, DistanceFieldParameters
from mapweave.matching.verification import VerificationParameters, coinciding, contradicting
from mapweave_fusion_server.web.parts import rounded


def evidence_content(
    alignment: Alignment, reference: LineMap, other: LineMap, config: Config
) -> dict[str, Any]:
    """Return what speaks for and against an alignment, and against its runner-up.

    Parameters
    ----------
    reference, other
        The lines of its components, each in its component's frame, none empty.

    Returns
    -------
    dict
        ``best`` and ``runner_up``, each with the transform and the places (n, 2) [m] on walls that
        are shared or contradicted, frame of `reference`.
    """
    parameters = DistanceFieldParameters.of(config)
    fields = DistanceField.of(reference, parameters), DistanceField.of(other, parameters)
    rules, rival = VerificationParameters.of(config), alignment.runner_up
    return {
        "best": _match(*fields, alignment.transform, rules),
        "runner_up": None if rival is None else _match(*fields, rival.transform, rules),
    }


def _match(
    ours: DistanceField, theirs: DistanceField, transform: FloatArray, rules: VerificationParameters
) -> dict[str, Any]:
    samples = se2.transform_points(transform, theirs.oriented.points)
    shared = samples[coinciding(ours, theirs, transform, rules)]
    against = samples[contradicting(ours, theirs, transform, rules)]
    refuted = ours.oriented.points[contradicting(theirs, ours, se2.inverse(transform), rules)]
    return {
        "transform": transform.tolist(),
        "shared": rounded(shared),
        "contradicted": rounded(against) + rounded(refuted),
    }
