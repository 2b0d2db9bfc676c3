"""Side by side: the same pairs for what a user might take instead of mapweave."""

import argparse
import importlib
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from types import ModuleType

import numpy as np

from benchmarks.logs import Log, find_logs
from benchmarks.pairs import Pair, choose_pairs, compare
from benchmarks.peer_features import feature_peers
from benchmarks.peer_figures import tell
from benchmarks.peer_kiss import kiss_peer
from benchmarks.peer_sweep import sweep_peer
from benchmarks.peer_trials import Trial, trial_of, try_peer
from benchmarks.peer_types import Peer, View
from benchmarks.peer_views import CELL, view_stretches
from benchmarks.stretches import Stretch, map_stretches
from benchmarks.tables import OUTPUT, write_json
from mapweave.commands.progress import track
from mapweave.maps import RobotMap

ROWS = OUTPUT / "peers.json"
EXTRA = "pip install -e '.[peers]'"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Say which logs and pairs, whether mapweave too, and where the rows go."""
    parser.add_argument("--logs", nargs="+", metavar="NAME", help="which logs (default all)")
    parser.add_argument(
        "--stretches", type=int, default=6, metavar="N", help="a log is cut into (6)"
    )
    parser.add_argument(
        "--across", type=int, default=200, metavar="N", help="pairs across buildings at most (200)"
    )
    parser.add_argument(
        "--cell", type=float, default=CELL, metavar="M", help="of the grids (%(default)s m)"
    )
    parser.add_argument("--pairs", type=int, metavar="N", help="only so many of all, drawn")
    parser.add_argument("--seed", type=int, default=1, help="draws pairs (1)")
    parser.add_argument(
        "--mapweave", action="store_true", help="map the stretches and compare them as well"
    )
    parser.add_argument("--output", type=Path, default=ROWS, help="rows as JSON (%(default)s)")


def run(options: argparse.Namespace) -> None:
    """Let every peer guess the pairs, print the table, write the rows."""
    logs = find_logs(options.logs)
    views = _view_all(logs, [options.stretches], options.cell)
    stretches = (
        [stretch for log in logs for stretch in map_stretches(log, options.stretches)]
        if options.mapweave
        else [_unmapped(view) for view in views.values()]
    )
    chosen = _draw(choose_pairs(stretches, options.across, options.seed), options)
    own = [compare(a, b) for a, b in track(chosen, "mapweave")] if options.mapweave else []
    print(_meet(views, [(a.name, b.name) for a, b in chosen], own, options.output))


def tell_beside(
    own: Sequence[Pair], logs: Sequence[Log], counts: Sequence[int], output: Path = ROWS
) -> str:
    """Return the table of mapweave's `own` results and the peers' on the same pairs.

    Parameters
    ----------
    own
        Of stretches of `logs`.
    counts
        Into how many stretches each of them was cut.
    output
        Where the peers' rows go, as JSON.
    """
    pairs = [(pair.first, pair.second) for pair in own]
    return _meet(_view_all(logs, counts, CELL), pairs, own, output)


def find_peers() -> list[Peer]:
    """Return the peers whose packages are there; say which ones are left out."""
    cv2, kiss_matcher = _find("cv2", "AKAZE and ORB"), _find("kiss_matcher", "KISS-Matcher")
    return [
        *(feature_peers(cv2) if cv2 else []),
        *([kiss_peer(kiss_matcher)] if kiss_matcher else []),
        sweep_peer(),
    ]


def _find(module: str, who: str) -> ModuleType | None:
    try:
        return importlib.import_module(module)
    except ImportError as error:
        print(f"{who} left out: {error}; {EXTRA} brings it")
        return None


def _view_all(logs: Sequence[Log], counts: Sequence[int], cell: float) -> dict[str, View]:
    cuts = [(log, count) for count in counts for log in logs]
    return {view.name: view for cut in cuts for view in view_stretches(*cut, cell)}


def _unmapped(view: View) -> Stretch:
    """Return the stretch that a view is of, without a map: enough to choose pairs."""
    return Stretch(view.name, view.log, RobotMap(view.name, "", 0, ()), view.cells, {})


def _draw(
    pairs: list[tuple[Stretch, Stretch]], options: argparse.Namespace
) -> list[tuple[Stretch, Stretch]]:
    if options.pairs is None or options.pairs >= len(pairs):
        return pairs
    drawn = np.random.default_rng(options.seed).choice(len(pairs), options.pairs, replace=False)
    return [pairs[k] for k in sorted(drawn)]


def _meet(
    views: dict[str, View], pairs: Sequence[tuple[str, str]], own: Sequence[Pair], output: Path
) -> str:
    """Try all peers, write the rows after each, return the table."""
    ours = [trial_of(pair) for pair in own]
    met: list[tuple[float, Sequence[Trial]]] = []
    for peer in find_peers():
        met.append((peer.threshold, try_peer(peer, views, pairs)))
        rows = [asdict(trial) for _, trials in met for trial in trials]
        write_json(output, rows)
    return f"{tell(ours, met)}\nWhat each peer made of each pair is in {output}"
