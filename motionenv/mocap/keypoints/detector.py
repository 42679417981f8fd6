"""Detect everybody's keypoints in pictures with RTMLib (https://github.com/Tau-J/rtmlib); needs `motionenv[detect]`.

YOLOX finds people, and RTMPose (Jiang et al. 2023, arXiv:2303.07399) the 26 keypoints of Halpe, body with feet, of each
of them. RTMLib downloads the published models' weights (Apache 2.0) when they are first used.
"""

import io
import zipfile
from collections.abc import Callable, Iterable
from contextlib import redirect_stdout
from typing import Any

import numpy as np

from motionenv.errors import FormatError, MotionError
from motionenv.mocap.keypoints.people import Track, followed

_ELSEWHERE = (
    "detect people elsewhere, and pass the file or folder that OpenPose, MMPose, Ultralytics or AlphaPose wrote"
)


def detect_people(
    pictures: Iterable[np.ndarray], *, weights: tuple[Any, Any] | None = None,
    on_progress: Callable[[int], None] | None = None, name: str = "the film",
) -> tuple[list[Track], int]:  # fmt: skip
    """Tracks of everybody and the number of frames, as of `motionenv.mocap.keypoints.detections.read`.

    Args:
        pictures: uint8 (height, width, 3) RGB, one after the other.
        weights: ONNX files of a YOLOX detector of people and of an RTMPose model; None downloads published ones.
        on_progress: called with the number of pictures that are done.
        name: of the film, for messages.

    Raises:
        MotionError: RTMLib isn't installed, or the weights can't be had or used.
        FormatError: nobody is seen.
    """
    people, pose = _models(weights)
    found: list[tuple] = []
    frames = 0
    for frames, picture in enumerate(pictures, 1):
        backwards = np.ascontiguousarray(picture[..., ::-1])  # RTMLib's pictures are BGR, as OpenCV's
        boxes = people(backwards)
        if len(boxes):  # without boxes, RTMPose would take the whole picture for somebody
            places, scores = pose(backwards, bboxes=boxes)
            found += [
                (frames - 1, np.column_stack([*each]).astype(float), None) for each in zip(places, scores, strict=True)
            ]
        if on_progress is not None:
            on_progress(frames)
    if not found:
        raise FormatError(name, f"shows nobody in {frames} frames: {_ELSEWHERE}")
    return followed(name, found), frames


def _models(weights: tuple[Any, Any] | None) -> tuple[Any, Any]:
    try:
        from onnxruntime.capi import onnxruntime_pybind11_state as onnx
        from rtmlib import YOLOX, BodyWithFeet, RTMPose
    except ImportError as error:
        raise MotionError(
            f"detecting people needs RTMLib, but {error.name} is missing: pip install 'motionenv[detect]', "
            f"or {_ELSEWHERE}"
        ) from error
    unusable = onnx.Fail, onnx.InvalidArgument, onnx.InvalidGraph, onnx.InvalidProtobuf, onnx.NoSuchFile
    known = BodyWithFeet.MODE["balanced"]
    files = [known["det"], known["pose"]] if weights is None else [str(path) for path in weights]
    try:
        with redirect_stdout(io.StringIO()):  # it tells which files it loads
            people = YOLOX(files[0], model_input_size=known["det_input_size"])
            pose = RTMPose(files[1], model_input_size=known["pose_input_size"])
        if weights is not None:
            people.model_input_size, pose.model_input_size = _side(people), _side(pose)[::-1]
    except (OSError, RuntimeError, UnboundLocalError, ValueError, zipfile.BadZipFile, *unusable) as error:
        problem = (
            "can't be downloaded: connect to the internet once, or give them" if weights is None else "can't be used"
        )
        raise MotionError(
            f"RTMLib's weights {problem}: weights=(detector, pose) (--weights) must be ONNX files of YOLOX and RTMPose "
            f"for pictures of one size; or {_ELSEWHERE}"
        ) from error
    return people, pose


def _side(model: Any) -> tuple[int, int]:
    """Height and width of the pictures that a model takes; raises ValueError if it leaves them open."""
    _, _, rows, columns = model.session.get_inputs()[0].shape
    return int(rows), int(columns)
