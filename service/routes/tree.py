"""Motion from a database (paper C): `POST /v1/tree/samples` and `POST /v1/tree/synthesis`."""

import math
import secrets
from typing import Any

import numpy as np
from fastapi import APIRouter, Request
from starlette.responses import Response

from motionenv.models import Target
from motionenv.models.motion_tree import MotionTree, Options, history
from motionenv.types import POSE, Motion
from service.errors import Problem, documented
from service.formats import dumps
from service.responses.motion_response import RESPONSES, answer
from service.schemas.tree import FromTree, SamplesRequest, SamplesResponse, TreeSynthesisRequest
from service.transport.access import access_of

router = APIRouter(prefix="/v1/tree", tags=["tree"])
_INLINE = 1000  # draws that take less than 2 ms
_REFUSALS = documented(400, 401, 404, 413, 415, 422, 429, 503, 504)


@router.post("/samples", summary="Next poses", responses={200: {"model": SamplesResponse}, **_REFUSALS})
async def sample_poses(request: Request, asked: SamplesRequest) -> Response:
    """Poses drawn from p(next | history), each with the leaf, the probability and the clip that it came from."""
    service = request.app.state.service
    tree = tree_of(request, asked)
    seed = secrets.randbits(32) if asked.seed is None else asked.seed
    work = lambda: _samples(tree, asked, seed)
    body = work() if asked.n <= _INLINE else await service.worker_pool.run(work)
    return Response(body, media_type="application/json")


@router.post("/synthesis", summary="Motion that grows", response_class=Response, responses=RESPONSES)
async def synthesize_activity(request: Request, asked: TreeSynthesisRequest) -> Response:
    """Motion of any length, 30 frames a second, after a history, an activity, or anything; formats by `Accept`."""
    tree = tree_of(request, asked)

    def make(seed: int) -> Motion:
        heading = None if asked.heading is None else math.radians(asked.heading)
        return tree.generator(
            asked.start if asked.history is None else np.array(asked.history), temperature=asked.temperature,
            seed=seed, method=asked.method, target=Target(asked.activity, heading, asked.speed),
            contact=asked.contact, blend=Options.blend if asked.blend else 0.0,
        ).motion(asked.seconds)  # fmt: skip

    return await answer(request, asked, make, quick=False)


def tree_of(request: Request, asked: FromTree) -> MotionTree:
    """The tree that is asked for; 404 without such a model, 422 for one that is no tree."""
    registry = request.app.state.service.model_registry
    tree = registry.get(asked.model, access_of(request.scope))
    if not isinstance(tree, MotionTree):
        raise Problem(422, f"{asked.model} is no tree but a {tree.kind} model", field="/model")
    return tree


def _samples(tree: Any, asked: SamplesRequest, seed: int) -> bytes:
    rng = np.random.default_rng(seed)
    before = history(tree, asked.start, seed=rng) if asked.history is None else np.array(asked.history)
    drawn = tree.sample(
        before, asked.n, temperature=asked.temperature, seed=rng, method=asked.method, carry=asked.carry,
        noise=asked.noise,
    )  # fmt: skip
    clip = tree.source(drawn.windows)
    names = tree.database_.clips
    answer = {
        "model": asked.model, "seed": seed, "pose": POSE, "poses": drawn.poses, "windows": drawn.windows,
        "leaves": tree.leaf(drawn.windows), "probabilities": np.exp(drawn.log_probability), "clip": clip,
        "clips": {str(i): names[i] for i in sorted(set(clip.tolist()))},
    }  # fmt: skip
    return dumps(answer)
