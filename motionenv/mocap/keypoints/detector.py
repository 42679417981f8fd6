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
    pictures: Iterable[np.ndarray],
    *,
    weights: tuple[Any, Any] | None = None,
    on_progress: Callable[[int], None] | None = None,
    name: str = "the film",
) -> tuple[list[Track], int]:
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
    """RTMLib's detector of people, and of their keypoints."""
    try:
        from rtmlib import YOLOX, BodyWithFeet, RTMPose
    except ImportError as error:
        missing = (
            "RTMLib" if error.name == "rtmlib" else f"RTMLib and what it uses, of which {error.name} can't be loaded"
        )
        raise MotionError(
            f"detecting people needs {missing}: pip install 'motionenv[detect]', or {_ELSEWHERE}"
        ) from error
    published = BodyWithFeet.MODE["balanced"]
    files, sizes = [published["det"], published["pose"]], [published["det_input_size"], published["pose_input_size"]]
    if weights is not None:
        files = [str(path) for path in weights]
        sizes = [_input_size(files[0]), _input_size(files[1])[::-1]]  # RTMPose takes width and height
    try:
        with redirect_stdout(io.StringIO()):  # it tells which files it loads
            return YOLOX(files[0], model_input_size=sizes[0]), RTMPose(files[1], model_input_size=sizes[1])
    except (OSError, RuntimeError, UnboundLocalError, zipfile.BadZipFile) as error:
        raise MotionError(
            "RTMLib's weights can't be downloaded: connect to the internet once, give ONNX files of YOLOX and RTMPose "
            f"as weights=(detector, pose) (--weights), or {_ELSEWHERE}"
        ) from error


def _input_size(path: str) -> tuple[int, int]:
    """Height and width of the pictures that the model in an ONNX file takes."""
    from onnxruntime import InferenceSession
    from onnxruntime.capi.onnxruntime_pybind11_state import (
        Fail,
        InvalidArgument,
        InvalidGraph,
        InvalidProtobuf,
        NoSuchFile,
    )

    try:
        shape = InferenceSession(path, providers=["CPUExecutionProvider"]).get_inputs()[0].shape
    except (Fail, InvalidArgument, InvalidGraph, InvalidProtobuf, NoSuchFile) as error:
        raise MotionError(f"weights must be ONNX files of YOLOX and RTMPose, which {path} isn't") from error
    if len(shape) != 4 or not all(isinstance(side, int) for side in shape[2:]):
        raise MotionError(
            f"weights must be models of pictures (1, 3, height, width) of fixed size, {path} takes {shape}"
        )
    return shape[2], shape[3]
