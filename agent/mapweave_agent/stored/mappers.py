"""What an agent gives its scans to, with the process beside it."""

import logging
from collections.abc import Iterator
from contextlib import contextmanager

from mapweave.commands.starting import Start
from mapweave.config import Config
from mapweave.mapping.continuation import to_continue
from mapweave.mapping.localization.localizer import Localizer
from mapweave.mapping.localization.place_finder import PlaceFinderParameters
from mapweave.mapping.mapper import Mapper, MapperParameters
from mapweave.mapping.scan_mapper import ScanMapper
from mapweave_agent.backend_process import BackendProcess
from mapweave_agent.stored.place_process import PlaceProcess

_log = logging.getLogger(__name__)


@contextmanager
def mapper_of(
    start: Start, robot: str, boot: str, config: Config, *, live: bool
) -> Iterator[ScanMapper]:
    """Give a block what maps, or localizes, as `start` says; parameters as of `Mapper`."""
    if start.place is not None:
        with PlaceProcess(start.place, PlaceFinderParameters.of(config)) as searcher:
            yield Localizer(
                start.place,
                robot,
                boot,
                config,
                searcher,
                live=live,
                on_warning=_log.warning,
                on_news=_log.info,
            )
        return
    parameters = MapperParameters.of(config)
    with BackendProcess(parameters.backend, to_continue(start.known)) as backend:
        yield Mapper(
            robot,
            boot,
            parameters,
            backend,
            config,
            live=live,
            on_warning=_log.warning,
            known=start.known,
        )
