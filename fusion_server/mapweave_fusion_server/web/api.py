"""The JSON interface; ``static/openapi.json`` describes it."""

import asyncio
from collections.abc import AsyncIterator
from functools import partial

from starlette.concurrency import run_in_threadpool
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import Response, StreamingResponse
from starlette.routing import Route

from mapweave.errors import InvalidComponentError
from mapweave.io.annotations import placed_mark_content
from mapweave.io.map_files import alignment_content
from mapweave.maps import parse_component
from mapweave_fusion_server.web.downloads import (
    SUFFIXES,
    TYPES,
    ExportFailedError,
    export_version,
)
from mapweave_fusion_server.web.events import Bell, Stream, after_of
from mapweave_fusion_server.web.evidence import evidence_content
from mapweave_fusion_server.web.knowledge import Knowledge
from mapweave_fusion_server.web.parts import part_content, scene_of
from mapweave_fusion_server.web.versions.json_text import to_json

DEFAULT_LIMIT, MAX_LIMIT = 10, 100  # whole versions in one answer
MAX_LISTED = 100_000  # numbers and times of versions in one answer
MAX_STREAMS = 64


class Api:
    """Answers what is asked for, from `knowledge`; `bell` rings when there is news."""

    def __init__(self, knowledge: Knowledge, bell: Bell) -> None:
        self._known = knowledge
        self._bell = bell
        self._streams = 0
        self._one_at_a_time = asyncio.Lock()  # what computes for long

    @property
    def routes(self) -> list[Route]:
        """What can be asked for, and by whom it is answered."""
        return [
            Route("/api/joint", self._joint),
            Route("/api/joint/{number:int}", self._version),
            Route("/api/joint/{number:int}/paths", self._paths),
            Route("/api/joint/{number:int}/evidence/{index:int}", self._evidence),
            Route("/api/joint/{number:int}.{suffix}", self._file),
            Route("/api/versions", self._versions),
            Route("/api/robots", self._robots),
            Route("/api/poses", self._poses),
            Route("/api/parts/{robot}/{component:int}", self._part),
            Route("/api/alignments", self._alignments),
            Route("/api/marks", self._marks),
            Route("/api/story", self._story),
            Route("/events", self._events),
        ]

    async def _joint(self, request: Request) -> Response:
        """Answer with the latest version, or with those since one."""
        since = _count(request, "since", None)
        if since is None:
            return await self._answer_version(self._known.history.latest)
        limit = _count(request, "limit", DEFAULT_LIMIT) or DEFAULT_LIMIT
        made = partial(self._since, since, min(limit, MAX_LIMIT))
        return _json(await run_in_threadpool(made))

    def _since(self, since: int, limit: int) -> bytes:
        history = self._known.history
        numbers = [number for number, _ in history.created(since, limit)]
        versions = b",".join(history.json(number) or b"null" for number in numbers)
        return b'{"latest":%d,"versions":[%s]}' % (history.latest, versions)

    async def _version(self, request: Request) -> Response:
        return await self._answer_version(request.path_params["number"])

    async def _answer_version(self, number: int) -> Response:
        return _json(await run_in_threadpool(self._json_of, number))

    def _json_of(self, number: int) -> bytes:
        content = self._known.history.json(number)
        if content is None:
            latest = self._known.history.latest
            there = f"there are 1 to {latest}" if latest else "there is none yet"
            raise HTTPException(404, f"no version {number} of the joint map; {there}")
        return content

    async def _file(self, request: Request) -> Response:
        """Answer with a version as a file; one is made at a time."""
        number, suffix = request.path_params["number"], f".{request.path_params['suffix']}"
        if suffix not in (*SUFFIXES, ".json"):
            known = ", ".join((*SUFFIXES, ".json"))
            raise HTTPException(404, f"no such file; expected one of {known}")
        content = await run_in_threadpool(self._json_of, number)
        if suffix != ".json":
            async with self._one_at_a_time:
                try:
                    content = await export_version(content, suffix)
                except ExportFailedError as error:
                    raise HTTPException(501, str(error)) from error
        name = f"joint-{number}{suffix}"
        headers = {"Content-Disposition": f'attachment; filename="{name}"'}
        return Response(content, 200, headers, TYPES.get(suffix, "application/json"))

    async def _paths(self, request: Request) -> Response:
        """Answer with the paths of a version, or that they are no longer kept."""
        number = request.path_params["number"]
        paths = self._known.paths.of(number)
        if paths is None:
            nothing = {"version": number, "kept": False, "components": {}, "robots": {}}
            return _json(to_json(nothing))
        return _json(b'{"version":%d,"kept":true,%s' % (number, paths.json()[1:]))

    async def _part(self, request: Request) -> Response:
        """Answer with a robot's own lines of a component, as they are now."""
        name = f"{request.path_params['robot']}/{request.path_params['component']}"
        return _json(await run_in_threadpool(self._part_of, name))

    def _part_of(self, name: str) -> bytes:
        scene = scene_of(self._known.feed.seen.maps, _checked(name))
        if scene is None:
            raise HTTPException(404, f"no map of component {name} is here now")
        return to_json(part_content(name, scene.map))

    async def _evidence(self, request: Request) -> Response:
        """Answer with where two parts agree and where they do not; one is worked out at a time."""
        number, index = request.path_params["number"], request.path_params["index"]
        async with self._one_at_a_time:
            return _json(await run_in_threadpool(self._evidence_of, number, index))

    def _evidence_of(self, number: int, index: int) -> bytes:
        joint = self._known.history.joint(number)
        if joint is None or index >= len(joint.alignments):
            raise HTTPException(404, f"no alignment {index} of version {number}")
        alignment, maps = joint.alignments[index], self._known.feed.seen.maps
        scenes = [scene_of(maps, name) for name in (alignment.reference, alignment.other)]
        lines = [scene.map for scene in scenes if scene is not None and len(scene.map.segments)]
        if len(lines) < 2:
            raise HTTPException(404, "the maps that were compared are no longer here as they were")
        return to_json(evidence_content(alignment, lines[0], lines[1], self._known.config))

    async def _versions(self, request: Request) -> Response:
        since = _count(request, "since", 0) or 0
        limit = min(_count(request, "limit", MAX_LISTED) or MAX_LISTED, MAX_LISTED)
        history = self._known.history
        created = await run_in_threadpool(history.created, since, limit)
        content = {"series": history.series, "latest": history.latest, "versions": created}
        return _json(to_json(content))

    async def _robots(self, _request: Request) -> Response:
        return _json(self._known.team_json())

    async def _poses(self, _request: Request) -> Response:
        return _json(to_json(self._known.feed.positions.content()))

    async def _alignments(self, _request: Request) -> Response:
        return _json(await run_in_threadpool(self._alignments_json))

    def _alignments_json(self) -> bytes:
        joint = self._known.history.joint(self._known.history.latest)
        if joint is None:
            return to_json({"version": 0, "alignments": []})
        alignments = [alignment_content(alignment) for alignment in joint.alignments]
        return to_json({"version": joint.version, "alignments": alignments})

    async def _marks(self, _request: Request) -> Response:
        return _json(await run_in_threadpool(self._marks_json))

    def _marks_json(self) -> bytes:
        """Return the marks of the latest version, each with the component whose frame it is in."""
        joint = self._known.history.joint(self._known.history.latest)
        components = () if joint is None else joint.components
        marks = [
            {**placed_mark_content(mark), "frame": min(each.robots, key=parse_component)}
            for each in components
            for mark in each.marks
        ]
        return to_json({"version": 0 if joint is None else joint.version, "marks": marks})

    async def _story(self, request: Request) -> Response:
        lines = self._known.story.since(_count(request, "since", 0) or 0)
        return _json(to_json({"lines": lines}))

    async def _events(self, request: Request) -> Response:
        if self._streams >= MAX_STREAMS:
            raise HTTPException(503, f"{MAX_STREAMS} look already")
        stream = Stream(self._known, self._bell, after_of(request.headers.get("last-event-id")))
        return StreamingResponse(self._counted(stream), media_type="text/event-stream")

    async def _counted(self, stream: Stream) -> AsyncIterator[bytes]:
        self._streams += 1
        try:
            async for event in stream:
                yield event
        finally:
            self._streams -= 1


def _json(content: bytes) -> Response:
    return Response(content, media_type="application/json", headers={"Cache-Control": "no-store"})


def _count(request: Request, name: str, default: int | None) -> int | None:
    """Return the parameter `name` of the request, a number that counts."""
    text = request.query_params.get(name)
    if text is None:
        return default
    if not (text.isascii() and text.isdigit() and len(text) < 16):
        raise HTTPException(400, f"{name}={text!r}: expected a number, 0 or more")
    return int(text)


def _checked(component: str) -> str:
    try:
        parse_component(component)
    except InvalidComponentError as error:
        raise HTTPException(400, str(error)) from error
    return component
