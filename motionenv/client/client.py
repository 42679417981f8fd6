"""The client: motion, films and models of a service."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Self, TypedDict, Unpack
from urllib.parse import quote

import numpy as np

from motionenv.arguments import WalkArguments, keyword_arguments
from motionenv.client.connection import Connection
from motionenv.errors import MotionError
from motionenv.mocap import npz
from motionenv.types import Motion

_NPZ = "application/x-npz"
_FILES = {
    ".npz": _NPZ, ".csv": "text/csv", ".bvh": "model/x-bvh", ".glb": "model/gltf-binary", ".c3d": "application/x-c3d",
    ".trc": "text/x-trc", ".mot": "text/x-mot", ".json": "application/json",
}  # fmt: skip
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

    @keyword_arguments(Walk)
    def synthesize(self, model: str, seconds: float, fps: float, **walk: Unpack[Walk]) -> Motion:
        """The motion (frames, 25) that `motionenv.synthesize` makes of the same arguments, to the last bit.

        Args:
            model: its name.
            seconds: duration [s].
            fps: frames per second.
            walk: see `Walk`.
        """
        body = _walk(model, seconds, fps, walk, {})  # as NPZ, which is lossless and the fastest to read
        response = self._connection.request("POST", "/v1/synthesis", json=body, headers={"Accept": _NPZ})
        return npz.parse(response.content, f"the response of {self._connection.url}")

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


def _walk(model: str, seconds: float, fps: float, walk: Mapping[str, Any], picture: Picture | None) -> dict[str, Any]:
    given: dict[str, Any] = {"seconds": seconds, "fps": fps, **walk}
    if np.ndim(given.get("speed", 0.0)) == 2:
        given["speeds"] = given.pop("speed")
    body = {name: np.asarray(value).tolist() for name, value in given.items() if value is not None}
    return {"model": model, **body, "picture": dict(picture or {})}


def _media_type(suffix: str, known: Mapping[str, str] = _SAVED) -> str:
    try:
        return known[suffix.lower()]
    except KeyError:
        raise MotionError(f"suffix must be one of {', '.join(known)}, got {suffix!r}") from None
