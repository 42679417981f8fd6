"""The client: one method for each thing that a service does."""

import secrets
from collections.abc import Iterable, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any, Self, TypedDict, Unpack
from urllib.parse import quote

import numpy as np

from motionenv.client.answers import LiftedPoints, Model, ModelDetails, Samples, details, lifted, samples, taken
from motionenv.client.connection import Connection
from motionenv.client.jobs import Job
from motionenv.client.streams import Stream
from motionenv.errors import MotionError
from motionenv.mocap import npz
from motionenv.types import Motion, Points

_NPZ = "application/x-npz"
_FILES = {
    ".npz": _NPZ, ".csv": "text/csv", ".bvh": "model/x-bvh", ".glb": "model/gltf-binary", ".c3d": "application/x-c3d",
    ".json": "application/json",
}  # fmt: skip
_FILMS = {".mp4": "video/mp4", ".gif": "image/gif", ".webp": "image/webp"}
_SAVED = {**_FILES, **_FILMS, ".npy": "application/x-npy", ".png": "image/png"}


class Walk(TypedDict, total=False):
    """Who walks, and how; all as in `motionenv.synthesize`."""

    seed: int
    deviations: Sequence[float]
    scores: Sequence[float]
    speed: float
    height: float
    phase: float
    variation: float


class Picture(TypedDict, total=False):
    """How a film shows a motion; angles in degrees, colours from 0 to 1, as the API has them."""

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
    """A connection to a service of `motionenv serve`; a context manager that hangs up.

    Args:
        url: where the service is.
        key: the API key; None takes that of the environment variable MOTIONENV_KEY, if it is set.
        timeout: seconds that the service may be silent.
        patience: seconds, for each request, in which to ask again where too much is asked of the service (429, 503), as
            often as it says; 0: never.
        retries: how often to try to connect again.

    Every method raises `ServiceError` where the service refuses, fails or can't be reached.
    """

    def __init__(
        self,
        url: str = "http://127.0.0.1:8000",
        key: str | None = None,
        *,
        timeout: float = 120.0,
        patience: float = 30.0,
        retries: int = 2,
    ):
        self._connection = Connection(url, key, timeout, patience, retries)

    def __repr__(self):
        return f"<Client of {self._connection.url}>"

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Hang up."""
        self._connection.close()

    def models(self) -> list[Model]:
        """The models that the service has: those that ship first, then the fitted ones."""
        return [taken(Model, told) for told in self._connection.ask("GET", "/v1/models").json()["models"]]

    def model(self, name: str) -> ModelDetails:
        """All about a model.

        Args:
            name: of the model.
        """
        return details(self._connection.ask("GET", f"/v1/models/{quote(name)}").json())

    def remove_model(self, name: str) -> None:
        """Remove a fitted model.

        Args:
            name: of the model, fitted/….
        """
        self._connection.ask("DELETE", f"/v1/models/{quote(name)}")

    def synthesize(self, model: str, seconds: float, fps: float, **walk: Unpack[Walk]) -> Motion:
        """The motion (frames, 25) that `motionenv.synthesize` makes of the same arguments, to the last bit.

        Args:
            model: its name.
            seconds: duration [s].
            fps: frames per second.
            walk: see `Walk`.
        """
        return self._motion("/v1/synthesis", _walk(model, seconds, fps, walk, {}))

    def film(
        self, model: str, seconds: float, fps: float, *, suffix: str = ".mp4", picture: Picture | None = None,
        **walk: Unpack[Walk],
    ) -> bytes:  # fmt: skip
        """A film of a motion, or with ".png" one picture of it; or, with the suffix of another format, that.

        Args:
            model: its name.
            seconds: duration [s].
            fps: frames per second.
            suffix: of the format: see `save`.
            picture: how it is shown.
            walk: see `Walk`.
        """
        asked, accept = _walk(model, seconds, fps, walk, picture), _media_type(suffix)
        return self._connection.ask("POST", "/v1/synthesis", json=asked, headers={"Accept": accept}).content

    def save(
        self, path: str | Path, model: str, seconds: float, fps: float, *, picture: Picture | None = None,
        **walk: Unpack[Walk],
    ) -> None:  # fmt: skip
        """Write a motion or a film of it to a file while it comes, whole or not at all.

        Args:
            path: of the file: .bvh, .c3d, .csv, .glb, .json, .npy, .npz, or .mp4, .gif, .webp, .png.
            model: its name.
            seconds: duration [s].
            fps: frames per second.
            picture: how a film shows it.
            walk: see `Walk`.

        Raises:
            MotionError: the file can't be written.
        """
        asked, accept = _walk(model, seconds, fps, walk, picture), _media_type(Path(path).suffix)
        self._connection.save(path, "POST", "/v1/synthesis", json=asked, headers={"Accept": accept})

    def tree_samples(
        self, history: Motion | np.ndarray | str | None = None, n: int = 1, *, model: str = "mixed/tree", **how: Any
    ) -> Samples:
        """Poses that may come next.

        Args:
            history: poses (10 to 120, 25) [m, rad] at 30 frames/s, oldest first; or the name of an activity, of which
                the seed picks a window; or None for any.
            n: how many.
            model: the tree's name.
            how: seed, temperature, method, carry and noise, as of `MotionTree.sample`.
        """
        asked = {"model": model, "n": n, **_beginning(history), **how}
        return samples(self._connection.ask("POST", "/v1/tree/samples", json=asked).json())

    def tree_synthesize(
        self, seconds: float, history: Motion | np.ndarray | str | None = None, *, model: str = "mixed/tree", **how: Any
    ) -> Motion:
        """Motion of any length that grows from a tree, 30 frames a second, as of `motionenv.models.tree.synthesize`.

        Args:
            seconds: duration [s].
            history: what it goes on from, as of `tree_samples`.
            model: the tree's name.
            how: seed, temperature, method, blend, contact; and to steer, activity, heading [degrees], speed [m/s].
        """
        return self._motion("/v1/tree/synthesis", {"model": model, "seconds": seconds, **_beginning(history), **how})

    def lift(
        self, points: Points, alpha: float | None = None, *, elevation: float | None = 0.0, scale: float | None = None,
        robust: bool = True,
    ) -> LiftedPoints:  # fmt: skip
        """The 3D walk that 2D points of one camera show, as `motionenv.lift`.

        Args:
            points: (frames, 15, 2); NaN where missing.
            alpha: view angle [rad]; None finds it.
            elevation: by how much the camera looks down [rad]; None finds it.
            scale: pixels per metre at the walker; None finds it.
            robust: whether points far off count less.
        """
        seen = np.where(np.isfinite(points.positions), points.positions, None)  # type: ignore[call-overload]
        asked = {
            "points": seen.tolist(), "fps": points.fps, "unit": points.unit, "scale": scale, "robust": robust,
            "view": None if alpha is None else float(np.degrees(alpha)),
            "elevation": "unknown" if elevation is None else float(np.degrees(elevation)),
        }  # fmt: skip
        return lifted(self._connection.ask("POST", "/v1/lift", json=asked).json())

    def fit(self, name: str, files: Iterable[str | Path], *, kind: str = "fpca", **how: Any) -> Job:
        """Fit a model to motion capture.

        Args:
            name: the model will be fitted/<name>.
            files: of capture (.amc with its .asf, .bvh, .c3d, .npz, .trc); for eigenwalkers, what comes before the
                first _ in a file's name says who it is.
            kind: fpca, eigenwalkers or tree.
            how: fps and unit, where files don't say theirs; activity and mirrored, of a tree.
        """
        return self._uploaded("/v1/models", files, {"name": name, "kind": kind, **how})

    def inspect(self, files: Iterable[str | Path], **how: Any) -> Job:
        """Find what is in motion capture: markers or joints, the body that moves, the cycles of a walk.

        Args:
            files: of capture.
            how: fps and unit, where files don't say theirs.
        """
        return self._uploaded("/v1/jobs/inspect", files, how)

    def convert(self, files: Iterable[str | Path], suffix: str, **how: Any) -> Job:
        """Retarget motion capture to the body, and write it in another format.

        Args:
            files: a capture file, with its .asf where it is .amc.
            suffix: of the format: .bvh, .c3d, .csv, .glb, .json or .npz.
            how: fps and unit, where files don't say theirs.
        """
        return self._uploaded("/v1/jobs/convert", files, {"format": _media_type(suffix, _FILES), **how})

    def render(
        self, model: str, seconds: float, fps: float, *, suffix: str = ".mp4", picture: Picture | None = None,
        **walk: Unpack[Walk],
    ) -> Job:  # fmt: skip
        """Make a film that is too long to wait for.

        Args:
            model: its name.
            seconds: duration [s].
            fps: frames per second.
            suffix: of the format: .mp4, .gif or .webp.
            picture: how it is shown.
            walk: see `Walk`.
        """
        asked = {**_walk(model, seconds, fps, walk, picture), "format": _media_type(suffix, _FILMS)}
        return self._job("/v1/jobs/render", json=asked)

    def job(self, id_: str) -> Job:
        """A job, also one of another client.

        Args:
            id_: of the job.
        """
        return Job(self._connection, self._connection.ask("GET", f"/v1/jobs/{quote(id_, safe='')}").json())

    def jobs(self, limit: int = 50) -> list[Job]:
        """Everybody's jobs, the newest first.

        Args:
            limit: how many at most, up to 500.
        """
        told = self._connection.ask("GET", "/v1/jobs", params={"limit": limit}).json()
        return [Job(self._connection, one) for one in told["jobs"]]

    def stream(self, model: str = "walk/fpca", **settings: Any) -> Stream:
        """Motion without end, at its pace: poses to iterate over, whose settings change while it runs.

        Args:
            model: its name.
            settings: see `Stream.change`.
        """
        return Stream(self._connection, {"model": model, **settings})

    def _motion(self, path: str, asked: Mapping[str, Any]) -> Motion:
        """The motion that is asked for, as NPZ, which is exact and read the fastest."""
        answer = self._connection.ask("POST", path, json=asked, headers={"Accept": _NPZ})
        return npz.parse(answer.content, f"the answer of {self._connection.url}")

    def _uploaded(self, path: str, files: Iterable[str | Path], fields: Mapping[str, Any]) -> Job:
        """The job that files were handed in for.

        Raises:
            MotionError: a file can't be read.
        """
        form = {name: str(value) for name, value in fields.items() if value is not None}
        with ExitStack() as stack:
            try:
                opened = [("files", (Path(f).name, stack.enter_context(open(f, "rb")))) for f in files]
            except OSError as error:
                raise MotionError(f"can't read {error.filename}: {error.strerror}") from None
            return self._job(path, data=form, files=opened)

    def _job(self, path: str, **request: Any) -> Job:
        """The job that a request asks for; asked for again, it is the same job."""
        headers = {"Idempotency-Key": secrets.token_hex(16)}
        return Job(self._connection, self._connection.ask("POST", path, headers=headers, **request).json())


def _walk(model: str, seconds: float, fps: float, walk: Mapping[str, Any], picture: Picture | None) -> dict[str, Any]:
    """`SynthesisRequest` of the service."""
    given = {"seconds": seconds, "fps": fps, **walk}
    asked = {name: np.asarray(value).tolist() for name, value in given.items() if value is not None}
    return {"model": model, **asked, "picture": dict(picture or {})}


def _beginning(history: Motion | np.ndarray | str | None) -> dict[str, Any]:
    """`history` or `start` of the service's requests to trees."""
    if history is None:
        return {}
    if isinstance(history, str):
        return {"start": history}
    return {"history": np.asarray(getattr(history, "poses", history), dtype=float).tolist()}


def _media_type(suffix: str, known: Mapping[str, str] = _SAVED) -> str:
    """The media type of files called *`suffix`.

    Raises:
        MotionError: the service makes no such files.
    """
    try:
        return known[suffix.lower()]
    except KeyError:
        raise MotionError(f"suffix must be one of {', '.join(known)}, got {suffix!r}") from None
