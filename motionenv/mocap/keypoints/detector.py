"""Detect everybody's keypoints in the pictures of a film, and keep people apart; needs `motionenv[detect]`.

A detector is anything that sees people in a picture: `BlazePose`, by default, or `RTMPose`, or one's own.
"""

import os
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Protocol

import numpy as np
import pooch

from motionenv._core.validation import checked_choice
from motionenv.errors import FormatError, MotionError
from motionenv.mocap.keypoints.appearance import look_of
from motionenv.mocap.keypoints.people import Track, followed

#: Names of detectors, and the extra that each needs.
DETECTORS = {"blazepose": "detect", "rtmpose": "rtmpose"}

_ELSEWHERE = (
    "detect people elsewhere, and pass the file or folder that OpenPose, MMPose, Ultralytics or AlphaPose wrote"
)


class Detector(Protocol):
    """Sees people in the pictures of a film, one after the other."""

    def __call__(self, picture: np.ndarray) -> list[np.ndarray]:
        """Keypoints (n, 3), x, y [pixels] and score, of everybody in a `picture`, uint8 (height, width, 3), RGB."""


def detector(name: str = "blazepose", weights: str | Path | None = None) -> Detector:
    """The detector of a `name` in `DETECTORS`, with models from `weights`, or from the internet, once.

    Weights are a folder, or for BlazePose also MediaPipe's `.task` file or wheel.

    Raises:
        MotionError: no such name, its extra isn't installed, or the weights can't be had or used.
    """
    extra = DETECTORS[checked_choice(name, "--detector", DETECTORS)]
    try:
        if name == "rtmpose":
            from motionenv.mocap.keypoints.rtmpose import RTMPose

            return RTMPose(weights)
        from motionenv.mocap.keypoints.blazepose import BlazePose, read_models

        cache = Path(os.environ.get("MOTIONENV_CACHE") or pooch.os_cache("motionenv"))
        return BlazePose(read_models(weights, cache / "blazepose"))
    except ImportError as error:
        raise MotionError(
            f"detecting people by {name} needs {error.name}, which is missing: pip install 'motionenv[{extra}]', or "
            f"{_ELSEWHERE}"
        ) from error


def detect_people(
    pictures: Iterable[np.ndarray], seen_by: Detector, *, on_progress: Callable[[int], None] | None = None,
    name: str = "the film",
) -> tuple[list[Track], int]:  # fmt: skip
    """Tracks of everybody and the number of frames, as of `motionenv.mocap.keypoints.detections.read`.

    Args:
        pictures: uint8 (height, width, 3) RGB, one after the other.
        seen_by: what sees people in each of them.
        on_progress: called with the number of pictures that are done.
        name: of the film, for messages.

    Raises:
        FormatError: nobody is seen.
    """
    found: list[tuple] = []
    looks: list[np.ndarray] = []
    frames = 0
    for frames, picture in enumerate(pictures, 1):
        people = seen_by(picture)
        found += [(frames - 1, keypoints, None) for keypoints in people]
        looks += [look_of(picture, keypoints) for keypoints in people]
        if on_progress is not None:
            on_progress(frames)
    if not found:
        raise FormatError(name, f"shows nobody in {frames} frames: {_ELSEWHERE}")
    return followed(name, found, looks), frames
