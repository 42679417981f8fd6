"""Motion from a database (paper C): `POST /v1/tree/samples`."""

import secrets
from typing import Any

import numpy as np
from fastapi import APIRouter, Request
from starlette.responses import Response

from motionenv.models.tree import history
from motionenv.types import POSE
from service.encoding import dumps
from service.problems import Problem, documented
from service.schemas.tree import FromTree, SamplesRequest, SamplesResponse

router = APIRouter(prefix="/v1/tree", tags=["tree"])
_INLINE = 1000  # draws that take less than 2 ms
_REFUSALS = documented(400, 401, 404, 413, 422, 429, 503, 504)


@router.post("/samples", summary="Next poses", responses={200: {"model": SamplesResponse}, **_REFUSALS})
async def samples(request: Request, asked: SamplesRequest) -> Response:
    """Poses drawn from p(next | history), each with the leaf, the probability and the clip that it came from."""
    service = request.app.state.service
    tree = tree_of(service, asked)
    seed = secrets.randbits(32) if asked.seed is None else asked.seed
    work = lambda: _samples(tree, asked, seed)
    body = work() if asked.n <= _INLINE else await service.workshop.run(work)
    return Response(body, media_type="application/json")


def tree_of(service: Any, asked: FromTree) -> Any:
    """The tree that is asked for.

    Args:
        service: `service.app.Service`.
        asked: the request.

    Raises:
        Problem: 404 without such a model, 422 for one that is no tree.
    """
    tree = service.catalogue.get(asked.model)
    if tree.kind != "tree":
        raise Problem(422, f"{asked.model} is no tree but a {tree.kind} model", field="/model")
    return tree


def _samples(tree: Any, asked: SamplesRequest, seed: int) -> bytes:
    """`SamplesResponse` as JSON."""
    rng = np.random.default_rng(seed)
    before = history(tree, asked.start, seed=rng) if asked.history is None else np.array(asked.history)
    drawn = tree.sample(
        before, asked.n, temperature=asked.temperature, seed=rng, method=asked.method, carry=asked.carry,
        noise=asked.noise, probability=True,
    )  # fmt: skip
    clip = tree.source(drawn.windows)
    names = tree.database_.clips
    answer = {
        "model": asked.model, "seed": seed, "pose": POSE, "poses": drawn.poses, "windows": drawn.windows,
        "leaves": tree.leaf(drawn.windows), "probabilities": np.exp(drawn.log_probability), "clip": clip,
        "clips": {str(i): names[i] for i in np.unique(clip).tolist()},
    }  # fmt: skip
    return dumps(answer)
