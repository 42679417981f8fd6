"""3D from 2D: `POST /v1/lift`."""

import math

import numpy as np
from fastapi import APIRouter, Request
from starlette.responses import Response

from motionenv import Points
from motionenv.lifting import Lifted, gait_figures, gait_of, gait_page, lift
from motionenv.types import MARKERS, POSE, Camera
from service.errors import about, documented
from service.formats import dumps
from service.schemas.lift import LiftCamera, LiftRequest, LiftResponse

router = APIRouter(prefix="/v1", tags=["lift"])


@router.post(
    "/lift", summary="Reconstruct motion in 3D from 2D points",
    responses={200: {"model": LiftResponse}, **documented(400, 401, 413, 415, 422, 429, 503, 504)},
)  # fmt: skip
async def lift_points(request: Request, asked: LiftRequest) -> Response:
    """The most probable motion for 2D points of one camera, with uncertainties."""
    service = request.app.state.service
    body = await service.worker_pool.run(lambda: _lifted(asked))
    return Response(body, media_type="application/json")


def _lifted(asked: LiftRequest) -> bytes:
    with about("camera"):
        camera = _camera(asked.camera)
    with about("points"):
        found = lift(
            _points(asked), elevation=None if asked.elevation == "unknown" else math.radians(asked.elevation),
            camera=camera, height=asked.height,
            distortion=None if asked.camera is None else asked.camera.distortion,
        )  # fmt: skip
        gait = gait_of(found) if asked.gait else None
        return dumps(to_response(found) | {"gait": gait and gait_figures(gait) | {"page": gait_page(gait)}})


def _points(asked: LiftRequest) -> Points:
    rows = [[[*(point or (None, None)), None][:3] for point in frame] for frame in asked.points]
    values = np.array(rows, dtype=np.float64)
    told = np.isfinite(values[..., 2]).any()
    feet = None
    if asked.feet is not None:
        feet = np.array([[(point or (None, None))[:2] for point in frame] for frame in asked.feet], dtype=np.float64)
    return Points(values[..., :2], asked.fps, asked.unit, confidence=values[..., 2] if told else None, feet=feet)


def _camera(asked: LiftCamera | None) -> Camera | list[Camera] | np.ndarray | None:
    if asked is None:
        return None
    inner = np.array(asked.K)
    at = lambda R, t: Camera(inner, np.array(R), np.array(t), 1, 1)  # lifting doesn't need the picture's size
    if asked.poses is not None:
        return [at(pose.R, pose.t) for pose in asked.poses]
    return inner if asked.R is None else at(asked.R, asked.t)


def to_response(found: Lifted) -> dict:
    """Lifted motion as `LiftResponse`."""
    motion, other = found.motion(), found.free.other
    return {
        "other": other and {"positions": other.positions, "probability": other.probability},
        "misfit": found.misfit, "plausible": found.plausible, "unlike": found.unlike, "fps": motion.fps,
        "markers": MARKERS, "positions": found.markers().positions, "band": found.band,
        "heading": np.degrees(found.heading), "contact": found.contact,
        "pose": POSE, "poses": motion.poses, "height": motion.skeleton.height, "swapped": found.swapped,
    }  # fmt: skip
