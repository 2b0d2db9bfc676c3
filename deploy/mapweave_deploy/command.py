"""``mapweave team``: a whole team on this machine, from scans to the joint map."""

import argparse
import signal
import sys
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

from rich.console import Console
from rich.text import Text

from mapweave.cli import Command, config_of, say
from mapweave.config import Config
from mapweave.errors import FileError, MapweaveError
from mapweave.ids import check_id
from mapweave.io.map_files import write_joint
from mapweave.maps import MadeWith
from mapweave.pictures.picture import check_picture, draw_joint
from mapweave_deploy.run.display import open_display
from mapweave_deploy.run.following import agent_of
from mapweave_deploy.run.launcher import (
    SERVER,
    Plan,
    TeamOutcome,
    free_endpoint,
    latest_joint,
    page_of,
    run_team,
    start_server,
    with_free_port,
)
from mapweave_deploy.run.options import check_ports, check_source, configure
from mapweave_deploy.run.output_folder import OutputFolder
from mapweave_deploy.run.processes import ProcessGroup
from mapweave_deploy.run.report import (
    Verdicts,
    outcome_content,
    tell_files,
    tell_outcome,
    tell_verdicts,
)
from mapweave_deploy.run.team_plan import Member, simulated_team, team_from_logs
from mapweave_fusion_server.store import Store
from mapweave_fusion_server.web.address import new_token
from mapweave_fusion_server.web.loading import live_page
from mapweave_protocol.link.stopping import StopSignals

NAP = 0.2  # [s]


class LostRobotsError(MapweaveError):
    """Robots whose agents ended before they were done; the others' results are whole."""

    def __init__(self, robots: Sequence[str], logs: Path) -> None:
        agents = ", ".join(map(agent_of, robots))
        super().__init__(
            f"{agents} ended before the team was done: of what is left to map, nothing is in the"
            f" joint map (what was said: {logs})"
        )
        self.robots = robots


def run(options: argparse.Namespace) -> int:
    """Check what can be wrong, and run the team."""
    check_source(options)
    check_id("team", options.team)
    config = config_of(options)
    if options.http is not None:
        live_page()  # told now where a package is missing, not by a process that ends
    folder = OutputFolder(options.output)
    check_picture(folder.picture)  # likewise, not when all is done
    check_ports(options)
    if options.store is not None and options.store.exists():
        with Store(options.store, options.team):
            pass  # it is one, of this team, and nobody has it
    members = team_from_logs(options.logs, options.robots)
    # Whoever terminates a team means all of it, as with Ctrl-C.
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    with folder.taken():
        _run_in(folder, members, options, config)
    return 0


def _run_in(
    folder: OutputFolder, recorded: list[Member], options: argparse.Namespace, config: Config
) -> None:
    """Run the team, of `recorded` robots unless it is simulated; write what it came to."""
    console, made_with = Console(stderr=options.json), MadeWith.of(config)
    _say(console, [_source(options)])
    # The crew stops before what it wrote to is removed.
    with (
        _unfinished_store(folder.store) as new,
        TemporaryDirectory(prefix="mapweave-") as states,
        ProcessGroup(folder.logs) as crew,
    ):
        members = recorded or _simulated(options, folder)
        plan = _plan(options, members, options.store or new, Path(states))
        _say(console, _how_to_watch(plan))
        with open_display(console, plan.members) as display:
            try:
                outcome = run_team(crew, plan, display)
            except (KeyboardInterrupt, MapweaveError):
                with _undisturbed():
                    crew.stop(lowest_stage=SERVER)  # it stores what is pending
                    _say(console, _keep_so_far(plan, options.store, made_with, folder))
                raise
        store = _keep_store(plan.store, options.store or folder.store)
        staying = options.stay or (plan.page is not None and _is_attended(console))
        if staying:
            start_server(crew, plan, store)  # it serves while results are computed
        _tell(outcome, plan, options, made_with, folder, store, console)
        if staying:
            _stay(crew, plan, console)
    if outcome.lost:
        raise LostRobotsError(outcome.lost, folder.logs)


@contextmanager
def _undisturbed() -> Iterator[None]:
    """Let the word to end, which shells tell twice, not take away what a block keeps."""
    numbers = (signal.SIGINT, signal.SIGTERM)
    before = [signal.signal(number, signal.SIG_IGN) for number in numbers]
    try:
        yield
    finally:
        for number, handler in zip(numbers, before, strict=True):
            signal.signal(number, handler)


def _keep_so_far(
    plan: Plan, given: Path | None, made_with: MadeWith, folder: OutputFolder
) -> Iterator[str]:
    """Keep what a team had that was stopped, and say where; earlier results stay as they are."""
    try:
        joint = latest_joint(plan.store, plan.team) if plan.store.exists() else None
    except FileError as error:
        yield f"Nothing is kept: {error}"
        return
    if joint is not None:
        write_joint(folder.joint_so_far, replace(joint, made_with=made_with))
        store = _keep_store(plan.store, given or folder.store_so_far)
        what = f"the joint map so far, version {joint.version}"
        yield f"Kept: {what}: {folder.joint_so_far}; the store: {store}"


def _plan(options: argparse.Namespace, members: list[Member], store: Path, states: Path) -> Plan:
    return Plan(
        team=options.team,
        members=members,
        rate=options.rate,
        listen=options.listen or free_endpoint(encrypted=options.tls is not None),
        store=store,
        timeout=options.timeout,
        config=options.config,
        states=states,
        page=None if options.http is None else with_free_port(options.http),
        token=new_token(),
        keys=options.tls,
    )


def _simulated(options: argparse.Namespace, folder: OutputFolder) -> list[Member]:
    return simulated_team(options.world, options.robots, options.seed, folder.scans, options.lidar)


@contextmanager
def _unfinished_store(final: Path) -> Iterator[Path]:
    """Give where the store is written until it is whole: an older one survives a failure."""
    new = final.with_name(f"{final.stem}-new{final.suffix}")
    _remove_store(new)
    try:
        yield new
    finally:
        _remove_store(new)


def _remove_store(path: Path) -> None:
    """Remove what there is of a store, with the files SQLite keeps beside it.

    A coordinator that is ended while it makes its store leaves the journal of that.
    """
    for end in ("", "-wal", "-shm", "-journal"):
        path.with_name(path.name + end).unlink(missing_ok=True)


def _keep_store(written: Path, final: Path) -> Path:
    written.replace(final)
    return final


def _tell(
    outcome: TeamOutcome,
    plan: Plan,
    options: argparse.Namespace,
    made_with: MadeWith,
    folder: OutputFolder,
    store: Path,
    console: Console,
) -> None:
    """Write the results, and tell what came of it."""
    write_joint(folder.joint, replace(outcome.joint, made_with=made_with))
    draw_joint(outcome.joint, folder.picture, outcome.maps)
    _say(console, tell_outcome(outcome, plan.members))
    files = [("picture", folder.picture), ("joint map", folder.joint), ("store", store)]
    files.append(("what each process said", folder.logs))
    _say(console, tell_files(files))
    verdicts = Verdicts.of(outcome, plan.members, simulated=options.world is not None)
    _say(console, tell_verdicts(outcome, plan.members, verdicts))
    say(options, outcome_content(outcome, plan.members, files, verdicts), ())


def _source(options: argparse.Namespace) -> str:
    if options.world is not None:
        return f"{options.robots} robots drive through the {options.world}, seed {options.seed}"
    return f"{options.robots} robots for each of: {', '.join(str(log) for log in options.logs)}"


def _how_to_watch(plan: Plan) -> Iterator[str]:
    keys = "" if plan.keys is None else " --tls DIR, with keys of the team"
    yield f"In another terminal: mapweave watch --team {plan.team} --connect {plan.listen}{keys}"


def _is_attended(console: Console) -> bool:
    """Tell whether a person is there who can end it."""
    return console.is_terminal and sys.stdin.isatty()


def _stay(crew: ProcessGroup, plan: Plan, console: Console) -> None:
    """Let router and coordinator serve until Ctrl-C, which is the way to end this."""
    stopping = StopSignals()
    _say(console, [*page_of(crew, plan), "Router and coordinator stay; Ctrl-C ends them."])
    while not stopping():
        crew.check()
        time.sleep(NAP)


def _say(console: Console, lines: Iterable[str]) -> None:
    for line in lines:
        console.print(Text(line), soft_wrap=True)


command = Command(
    "Run a whole team on this machine.", configure, run, "--world office --robots 3 --output team"
)
