"""The client: motion, films, models and jobs of a service."""

import json
import secrets
from collections.abc import Iterable, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any, Self, TypedDict, Unpack
from urllib.parse import quote

import numpy as np

from motionenv.arguments import WalkArguments, keyword_arguments
from motionenv.client.connection import Connection
from motionenv.client.jobs import Job
from motionenv.errors import MotionError
from motionenv.mocap import MarkerMap, npz
from motionenv.types import Motion

_NPZ = "application/x-npz"
_FILES = {
    ".npz": _NPZ, ".csv": "text/csv", ".bvh": "model/x-bvh", ".glb": "model/gltf-binary", ".c3d": "application/x-c3d",
    ".trc": "text/x-trc", ".mot": "text/x-mot", ".json": "application/json",
}  # fmt: skip
_REPORTS = {".html": "text/html", ".json": "application/json", ".csv": "text/csv"}
_FILMS = {".mp4": "video/mp4", ".gif": "image/gif", ".webp": "image/webp"}
_SAVED = {**_FILES, **_FILMS, ".npy": "application/x-npy", ".png": "image/png"}


class Walk(WalkArguments, total=False):
    """The walker and its walk; everything as in `motionenv.synthesize`."""

    seed: int
    deviations: Sequence[float]
    scores: Sequence[float]
    speed: float | Sequence[Sequence[float]]
    path: Sequence[Sequence[float]]


class Picture(TypedDict, total=False):
    """How a video shows a motion; angles in degrees and colours from 0 to 1, as in the API."""

    width: int
    height: int
    view: float
    elevation: float
    follow: bool
    style: str
    colour: Sequence[float]
    background: Sequence[float]
    engine: str
    frame: int


class Client:
    """A connection to a service of `motionenv serve`; a context manager that closes it.

    Args:
        url: where the service is.
        key: the API key; None takes that of the environment variable MOTIONENV_KEY, if it is set.
        timeout: seconds to wait for data from the service.
        patience: seconds for which a request is repeated while the service is overloaded (429, 503), at the intervals
            that it asks for; 0: never.
        retries: number of further attempts to connect.

    Every method raises `ServiceError` where the service refuses a request, fails or can't be reached.
    """

    def __init__(
        self, url: str = "http://127.0.0.1:8000", key: str | None = None, *, timeout: float = 120.0,
        patience: float = 30.0, retries: int = 2,
    ) -> None:  # fmt: skip
        self._connection = Connection(url, key, timeout, patience, retries)

    def __repr__(self):
        return f"<Client of {self._connection.url}>"

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the connection."""
        self._connection.close()

    def models(self) -> list[dict[str, Any]]:
        """The service's models: `ModelSummary` of its API for each, the shipped ones first."""
        return self._connection.request("GET", "/v1/models").json()["models"]

    def model(self, name: str) -> dict[str, Any]:
        """The card, components and bounds of the model called `name`: `ModelDescription` of the service's API."""
        return self._connection.request("GET", f"/v1/models/{quote(name)}").json()

    def remove_model(self, name: str) -> None:
        """Remove the fitted model called `name`, fitted/…."""
        self._connection.request("DELETE", f"/v1/models/{quote(name)}")

    def save_model(self, name: str, out: str | Path) -> None:
        """Write the file of a fitted model, which `motionenv.load` and other services take.

        Args:
            name: of the model, "fitted/…".
            out: the file, conventionally *.npz.

        Raises:
            ServiceError: there is no such model, or the response is incomplete.
            MotionError: the file can't be written.
        """
        self._connection.save(out, "GET", f"/v1/models/{quote(name)}/file")

    def upload_model(self, name: str, file: str | Path, *, replace: bool = False) -> Job:
        """A job that adds the model in a file (.npz) as fitted/<name>.

        Args:
            name: the model will be called fitted/<name>.
            file: of `save_model`, or of `motionenv fit`.
            replace: whether it may take the place of a model of that name; what has begun goes on with the old one.
        """
        return self._uploaded("/v1/models/files", [file], {"name": name, "replace": replace})

    @keyword_arguments(Walk)
    def synthesize(self, model: str, seconds: float, fps: float, **walk: Unpack[Walk]) -> Motion:
        """The motion (frames, 25) that `motionenv.synthesize` makes of the same arguments, to the last bit.

        Args:
            model: its name.
            seconds: duration [s].
            fps: frames per second.
            walk: see `Walk`.
        """
        return self._motion("/v1/synthesis", _walk(model, seconds, fps, walk, {}))

    @keyword_arguments(Walk)
    def film(
        self, model: str, seconds: float, fps: float, *, suffix: str = ".mp4", picture: Picture | None = None,
        **walk: Unpack[Walk],
    ) -> bytes:  # fmt: skip
        """A motion as the bytes of a video, of one picture (".png") or of any other format.

        Args:
            model, seconds, fps, walk: as of `synthesize`.
            suffix: of the format: see `save`.
            picture: how it is shown.
        """
        body, accept = _walk(model, seconds, fps, walk, picture), _media_type(suffix)
        return self._connection.request("POST", "/v1/synthesis", json=body, headers={"Accept": accept}).content

    @keyword_arguments(Walk)
    def save(
        self, out: str | Path, model: str, seconds: float, fps: float, *, picture: Picture | None = None,
        **walk: Unpack[Walk],
    ) -> None:  # fmt: skip
        """Write a motion or a video of it to a file as it arrives, whole or not at all; a MotionError if it can't be.

        Args:
            out: path of the file: .bvh, .c3d, .csv, .glb, .json, .mot, .npy, .npz, .trc, or .mp4, .gif, .webp, .png.
            model, seconds, fps, walk: as of `synthesize`.
            picture: how a film shows it.
        """
        body, accept = _walk(model, seconds, fps, walk, picture), _media_type(Path(out).suffix)
        self._connection.save(out, "POST", "/v1/synthesis", json=body, headers={"Accept": accept})

    def tree_synthesize(
        self, seconds: float, history: Motion | np.ndarray | str | None = None, *, model: str = "mixed/tree", **how: Any
    ) -> Motion:
        """Synthesize motion of any length from a tree at 30 frames/s, as `motionenv.models.motion_tree.synthesize`.

        Args:
            seconds: duration [s].
            history: poses (10 to 120, 25) [m, rad] at 30 frames/s, oldest first; or the name of an activity, of which
                the seed picks a window; or None for any.
            model: the tree's name.
            how: seed, temperature, method, blend, contact; and to steer, activity, heading [degrees], speed [m/s].
        """
        return self._motion("/v1/tree/synthesis", {"model": model, "seconds": seconds, **_beginning(history), **how})

    def fit(self, name: str, files: Iterable[str | Path], *, kind: str = "fpca", **how: Any) -> Job:
        """Fit a model to motion capture.

        Args:
            name: the model will be fitted/<name>.
            files: of capture (.amc with its .asf, .bvh, .c3d, .npz, .trc); for eigenwalkers, the part of a file's name
                before the first _ identifies the person.
            kind: fpca, eigenwalkers or tree.
            how: fps and unit, for files that don't contain them; marker_map, for points that aren't recognised by
                their names; fill, to fill what the files don't show; replace, to take the place of a model of that
                name; for a tree, activity and mirrored; for eigenwalkers, groups: two names, each with people.
        """
        if "groups" in how:
            how["groups"] = json.dumps(how["groups"])
        return self._uploaded("/v1/models", files, {"name": name, "kind": kind, **how})

    def inspect(self, files: Iterable[str | Path], **how: Any) -> Job:
        """Inspect captured `files`: markers or joints, the body, the gait cycles of a walk.

        `how`: fps and unit, for files that don't contain them; marker_map, for points whose names aren't recognised.
        """
        return self._uploaded("/v1/jobs/inspect", files, how)

    def points(self, files: Iterable[str | Path], **how: Any) -> Job:
        """List the points of a capture file, where they are, and which landmarks they may be: a marker map to edit.

        `files` are the file, with its .asf where it is .amc; `how` is as of `inspect`, but checks a marker_map.
        """
        return self._uploaded("/v1/jobs/points", files, how)

    def report(
        self, files: Iterable[str | Path], suffix: str = ".html", *, static: str | Path | None = None, **how: Any
    ) -> Job:
        """Report on the gait in captured `files`: step parameters, and joint angles over the cycle.

        The `suffix` of the format is .html, .json or .csv; `static` is the file of a static trial, if there is one;
        `how` is as of `inspect`, and age [years] and sex, "female" or "male", for published norms.
        """
        fields = {"format": _media_type(suffix, _REPORTS), "static": None if static is None else Path(static).name}
        return self._uploaded("/v1/jobs/report", files, {**fields, **how})

    def convert(self, files: Iterable[str | Path], suffix: str, **how: Any) -> Job:
        """Retarget a capture, `files` with its .asf where it is .amc, to the body, and write it in another format.

        The `suffix` of the format is .bvh, .c3d, .csv, .glb, .json, .mot, .npz or .trc; `how` is as of `inspect`, and
        fill, to fill what the file doesn't show.
        """
        return self._uploaded("/v1/jobs/convert", files, {"format": _media_type(suffix, _FILES), **how})

    @keyword_arguments(Walk)
    def render(
        self, model: str, seconds: float, fps: float, *, suffix: str = ".mp4", picture: Picture | None = None,
        **walk: Unpack[Walk],
    ) -> Job:  # fmt: skip
        """Render a video in a job, for those that take longer than a request may.

        Args:
            model, seconds, fps, picture, walk: as of `film`.
            suffix: of the format: .mp4, .gif or .webp.
        """
        body = {**_walk(model, seconds, fps, walk, picture), "format": _media_type(suffix, _FILMS)}
        return self._job("/v1/jobs/render", json=body)

    def job(self, id_: str) -> Job:
        """A job, whichever client submitted it.

        Args:
            id_: its id.
        """
        return Job(self._connection, self._connection.request("GET", f"/v1/jobs/{quote(id_, safe='')}").json())

    def jobs(self, limit: int = 50) -> list[Job]:
        """The jobs of all clients, newest first.

        Args:
            limit: maximum number of jobs, up to 500.
        """
        response = self._connection.request("GET", "/v1/jobs", params={"limit": limit}).json()
        return [Job(self._connection, one) for one in response["jobs"]]

    def _motion(self, path: str, body: Mapping[str, Any]) -> Motion:
        """A motion, requested as NPZ, which is lossless and the fastest to read."""
        response = self._connection.request("POST", path, json=body, headers={"Accept": _NPZ})
        return npz.parse(response.content, f"the response of {self._connection.url}")

    def _uploaded(self, path: str, files: Iterable[str | Path], fields: Mapping[str, Any]) -> Job:
        """The job that uploading files creates; a marker map becomes the field `map`."""
        form = {name: str(value) for name, value in fields.items() if value is not None and name != "marker_map"}
        if isinstance(marker_map := fields.get("marker_map"), MarkerMap):
            form["map"] = marker_map.to_toml()
        with ExitStack() as stack:
            try:
                opened = [("files", (Path(f).name, stack.enter_context(open(f, "rb")))) for f in files]
            except OSError as error:
                raise MotionError(f"can't read {error.filename}: {error.strerror}") from None
            return self._job(path, data=form, files=opened)

    def _job(self, path: str, **request: Any) -> Job:
        """The job that a request creates; a repeated request finds the same job."""
        headers = {"Idempotency-Key": secrets.token_hex(16)}
        return Job(self._connection, self._connection.request("POST", path, headers=headers, **request).json())


def _walk(model: str, seconds: float, fps: float, walk: Mapping[str, Any], picture: Picture | None) -> dict[str, Any]:
    given: dict[str, Any] = {"seconds": seconds, "fps": fps, **walk}
    if np.ndim(given.get("speed", 0.0)) == 2:
        given["speeds"] = given.pop("speed")
    body = {name: np.asarray(value).tolist() for name, value in given.items() if value is not None}
    return {"model": model, **body, "picture": dict(picture or {})}


def _beginning(history: Motion | np.ndarray | str | None) -> dict[str, Any]:
    """The field `history` or `start` of a request to a tree."""
    if history is None:
        return {}
    if isinstance(history, str):
        return {"start": history}
    return {"history": np.asarray(getattr(history, "poses", history), dtype=float).tolist()}


def _media_type(suffix: str, known: Mapping[str, str] = _SAVED) -> str:
    try:
        return known[suffix.lower()]
    except KeyError:
        raise MotionError(f"suffix must be one of {', '.join(known)}, got {suffix!r}") from None
