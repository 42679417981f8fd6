"""3D from 2D (paper B): `POST /v1/lift`."""

import math

import numpy as np
from fastapi import APIRouter, Request
from starlette.responses import Response

from motionenv import Points, WalkerPrior
from motionenv.estimation.lifting import UNLIKE, Lifted, OtherView, lift
from motionenv.types import MARKERS, POSE
from service.bodies import JsonRoute
from service.encoding import dumps
from service.problems import documented
from service.schemas.lift import LiftRequest, LiftResponse

router = APIRouter(prefix="/v1", tags=["lift"], route_class=JsonRoute)


@router.post(
    "/lift",
    summary="The 3D walk that 2D points show",
    responses={200: {"model": LiftResponse}, **documented(400, 401, 413, 415, 422, 429, 503, 504)},
)
async def lifting(request: Request, asked: LiftRequest) -> Response:
    """The most probable walk, the view from which the points show it, and how sure both are."""
    service = request.app.state.service
    prior = service.catalogue.get("walk/prior")
    body = await service.workshop.run(lambda: _lifted(asked, prior))
    return Response(body, media_type="application/json")


def _lifted(asked: LiftRequest, prior: WalkerPrior) -> bytes:
    """`LiftResponse` as JSON."""
    points = Points(_positions(asked), asked.fps, asked.unit)
    found = lift(
        points,
        None if asked.view is None else math.radians(asked.view),
        prior=prior,
        elevation=None if asked.elevation == "unknown" else math.radians(asked.elevation),
        scale=asked.scale,
        robust=asked.robust,
    )
    return dumps(_told(found))


def _positions(asked: LiftRequest) -> np.ndarray:
    """Points (frames, 15, 2); NaN where missing."""
    gap = (None, None)
    rows = [[gap if point is None else point for point in frame] for frame in asked.points]
    return np.array(rows, dtype=np.float64)


def _told(found: Lifted) -> dict:
    """What `LiftResponse` says of a lifted walk."""
    refined, motion = found.refined, found.motion()
    return {
        "view": math.degrees(refined.alpha),
        "view_deviation": math.degrees(refined.standard_deviation("alpha")),
        "elevation": math.degrees(refined.elevation),
        "others": [_view(other) for other in found.others],
        "contradiction": None if found.contradiction is None else _view(found.contradiction),
        "frequency": refined.frequency,
        "speed": found.walker.speed,
        "misfit": found.misfit,
        "plausible": bool(found.misfit <= UNLIKE and refined.converged),
        "fps": motion.fps,
        "markers": MARKERS,
        "positions": found.markers().positions,
        "band": found.band,
        "pose": POSE,
        "poses": motion.poses,
        "height": motion.skeleton.height,
        "swapped": found.swapped,
    }


def _view(other: OtherView) -> dict[str, float]:
    return {
        "view": math.degrees(other.alpha),
        "elevation": math.degrees(other.elevation),
        "probability": other.probability,
    }
