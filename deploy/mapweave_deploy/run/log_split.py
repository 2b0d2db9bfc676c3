"""A log cut into overlapping stretches, one a robot."""

OVERLAP = 0.2  # of a stretch, added at each of its ends


def cut(scans: int, robots: int, overlap: float = OVERLAP) -> list[tuple[int, int]]:
    """Return for each of `robots` robots its scans, first and behind the last.

    The `scans` are divided evenly; then each stretch grows by `overlap` of its length at each
    end, within the log.
    """
    bounds = [round(scans * k / robots) for k in range(robots + 1)]
    margin = round(overlap * scans / robots) if robots > 1 else 0
    return [(max(0, bounds[k] - margin), min(scans, bounds[k + 1] + margin)) for k in range(robots)]
