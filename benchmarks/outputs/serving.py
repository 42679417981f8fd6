"""Outputs of the environments and the HTTP service."""

import asyncio
import logging
import tempfile
import warnings
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.outputs.cases import output, walk
from benchmarks.outputs.estimating import points


@output("environment Walker", "Walker")
@output("environment Walker in clutter", "Walker", observation=("rgb", "mask", "depth"), camera="random",
        background="clutter", distractors=1, occluders=1, noise=5.0, brightness=0.2)  # fmt: skip
@output("environment Walker followed, belief", "Walker", camera="follow", estimate="belief", n_belief=5, split="eval")
@output("environment Marker", "Marker")
@output("environment Arm", "Arm", observation="mask")
@output("environment Arm that walks", "Arm", motion="walk/fpca", estimate="joints", observation="depth", camera=30)
def _environment(name: str, **how) -> Any:
    import gymnasium

    import motionenv.envs  # noqa: F401 (registers the environments)

    how |= {} if name == "Marker" else {"size": 36}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # Gymnasium warns about samples of unbounded action spaces
        env = gymnasium.make(f"motionenv/{name}Tracking-v1", horizon=10, render_mode="rgb_array", **how)
        envs = gymnasium.make_vec(f"motionenv/{name}Tracking-v1", num_envs=3, horizon=4, **how)
    found = []
    for each in (env, envs):
        each.action_space.seed(5)
        found.append(each.reset(seed=7))
        found += [each.step(each.action_space.sample()) for _ in range(6)]
    found += [env.render(), env.unwrapped.truth(), envs.unwrapped.truth()]
    env.close()
    envs.close()
    return found


# ── HTTP ──────────────────────────────────────────────────────────────────────────────────────────────────────────────

_ASKED = {"seed": 3, "seconds": 1.0, "fps": 30, "deviations": [1.0, -0.5], "speed": 1.2, "height": 1.6, "phase": 0.25,
          "picture": {"width": 64, "height": 48}}  # fmt: skip


def _answered(method: str, path: str, **how) -> Any:
    """Response of the service, run in this process, once its tree is ready. JSON is parsed, to compare its numbers."""
    import httpx
    import structlog

    from service.app import create_app
    from service.settings import Settings

    structlog.configure(wrapper_class=structlog.make_filtering_bound_logger(logging.ERROR))

    async def ask(folder: str) -> Any:
        app = create_app(Settings(data=Path(folder)))
        async with app.router.lifespan_context(app):
            async with httpx.AsyncClient(transport=httpx.ASGITransport(app), base_url="http://localhost") as client:
                while (await client.post("/v1/tree/samples", json={"seed": 1})).status_code == 503:
                    await asyncio.sleep(0.02)
                return await client.request(method, path, **how)

    with tempfile.TemporaryDirectory() as folder:
        answer = asyncio.run(ask(folder))
    kind = answer.headers["content-type"]
    if "json" not in kind:
        return [answer.status_code, kind, answer.content]
    told = answer.json()
    told.pop("request_id", None)  # unique to each request
    return [answer.status_code, kind, told]


@output("HTTP walk as JSON", "application/json")
@output("HTTP walk as NPZ", "application/x-npz")
@output("HTTP walk as NPY", "application/x-npy")
@output("HTTP walk as BVH", "model/x-bvh")
@output("HTTP walk as CSV", "text/csv")
@output("HTTP walk as GLB", "model/gltf-binary")
@output("HTTP walk as C3D", "application/x-c3d")
@output("HTTP walk as PNG", "image/png")
@output("HTTP walk as MP4", "video/mp4")
@output("HTTP walk as GIF", "image/gif")
def _http_walk(kind: str) -> Any:
    return _answered("POST", "/v1/synthesis", json=_ASKED, headers={"Accept": kind})


@output("HTTP walk of walk/eigenwalkers", "/v1/synthesis", model="walk/eigenwalkers", seed=2, seconds=1.0)
@output("HTTP walk of the tree", "/v1/tree/synthesis", seed=1, start="walk", seconds=1.0)
@output("HTTP problem", "/v1/synthesis", seconds=-1)
def _http_post(path: str, **body) -> Any:
    return _answered("POST", path, json=body)


@output("HTTP tree samples")
def _http_samples() -> Any:
    body = {"history": walk().poses.tolist(), "n": 20, "seed": 7, "temperature": 0.2, "method": "exact"}
    return _answered("POST", "/v1/tree/samples", json=body)


@output("HTTP lift")
def _http_lift() -> Any:
    seen = points(missing=0.1).positions
    body = {"points": np.where(np.isfinite(seen), seen, None).tolist(), "fps": 30, "unit": "m"}
    return _answered("POST", "/v1/lift", json=body)


@output("HTTP models", "/v1/models")
@output("HTTP model walk/fpca", "/v1/models/walk/fpca")
@output("HTTP model mixed/tree", "/v1/models/mixed/tree")
@output("HTTP parameters of walk/fpca", "/v1/models/walk/fpca/parameters")
@output("HTTP parameters of walk/eigenwalkers", "/v1/models/walk/eigenwalkers/parameters")
@output("HTTP description of the API", "/openapi.json")
def _http_get(path: str) -> Any:
    return _answered("GET", path)
