"""Detect everybody's keypoints in pictures with RTMLib (https://github.com/Tau-J/rtmlib); needs `motionenv[detect]`.

YOLOX finds people, and RTMPose (Jiang et al. 2023, arXiv:2303.07399) the 26 keypoints of Halpe, body with feet, of each
of them. RTMLib downloads both models' weights (Apache 2.0) when they are first used; files of one's own may be given.
"""

import io
import zipfile
from collections.abc import Callable, Iterable
from contextlib import redirect_stdout
from os import PathLike
from typing import Any

import numpy as np

from motionenv.errors import FormatError, MotionError
from motionenv.mocap.keypoints.people import Track, followed

#: Sizes of the published models, from the fastest to the most accurate.
MODES = ("lightweight", "balanced", "performance")
_INSTEAD = (
    "or detect people elsewhere, and pass the file or folder that OpenPose, MMPose, Ultralytics or AlphaPose wrote"
)


def detect_people(
    pictures: Iterable[np.ndarray],
    *,
    weights: tuple[str | PathLike, str | PathLike] | None = None,
    mode: str = "balanced",
    on_progress: Callable[[int], None] | None = None,
    name: str = "the film",
) -> tuple[list[Track], int]:
    """Tracks of everybody in a film, the longest and most confident first, and the number of frames.

    The result is that of `motionenv.mocap.keypoints.detections.read_everybody`.

    Args:
        pictures: uint8 (height, width, 3) RGB, one after the other.
        weights: ONNX files of a YOLOX detector of people and an RTMPose model; None downloads published ones of `mode`.
        mode: one of `MODES`.
        on_progress: called with the number of pictures that are done.
        name: of the film, for messages.

    Raises:
        MotionError: RTMLib isn't installed, the weights can't be had or used, or an argument out of range.
        FormatError: nobody is seen.
    """
    if mode not in MODES:
        raise MotionError(f"mode must be one of {', '.join(MODES)}, got {mode!r}")
    people, pose = _models(weights, mode)
    found: list[tuple] = []
    frames = 0
    for frame, picture in enumerate(pictures):
        backwards = np.ascontiguousarray(picture[..., ::-1])  # RTMLib's pictures are BGR, as OpenCV's
        boxes = people(backwards)
        if len(boxes):  # without boxes, RTMPose would take the whole picture for somebody
            places, scores = pose(backwards, bboxes=boxes)
            seen = np.concatenate([places, np.asarray(scores)[..., None]], axis=-1).astype(np.float64)
            found += [(frame, keypoints, None) for keypoints in seen]
        frames = frame + 1
        if on_progress is not None:
            on_progress(frames)
    if not found:
        raise FormatError(name, f"shows nobody in {frames} frames: {_INSTEAD.removeprefix('or ')}")
    return followed(name, found), frames


def _models(weights, mode: str) -> tuple[Any, Any]:
    """RTMLib's detector of people, and of their keypoints."""
    try:
        from rtmlib import YOLOX, BodyWithFeet, RTMPose
    except ImportError as error:
        problem = (
            "isn't installed" if error.name == "rtmlib" else "can't be loaded, as a library that it needs is missing"
        )
        raise MotionError(
            f"detecting people needs RTMLib, which {problem}: pip install 'motionenv[detect]', {_INSTEAD}"
        ) from error
    published = BodyWithFeet.MODE[mode]
    wide, tall = published["pose_input_size"]
    if weights is None:
        files, sizes = (published["det"], published["pose"]), (published["det_input_size"], (wide, tall))
    else:
        files = tuple(str(path) for path in weights)
        (rows, columns), (tall, wide) = (_input_size(path) for path in files)
        sizes = (rows, columns), (wide, tall)
    try:
        with redirect_stdout(io.StringIO()):  # it tells which files it loads
            return YOLOX(files[0], model_input_size=sizes[0]), RTMPose(files[1], model_input_size=sizes[1])
    except (OSError, RuntimeError, UnboundLocalError, zipfile.BadZipFile) as error:
        raise MotionError(
            "RTMLib's weights can't be downloaded: connect to the internet once, give ONNX files of YOLOX and RTMPose "
            f"as weights=(detector, pose) (--weights), {_INSTEAD}"
        ) from error


def _input_size(path: str) -> tuple[int, int]:
    """Height and width of the pictures that the model in an ONNX file takes."""
    from onnxruntime import InferenceSession
    from onnxruntime.capi import onnxruntime_pybind11_state as errors

    try:
        shape = InferenceSession(path, providers=["CPUExecutionProvider"]).get_inputs()[0].shape
    except (
        errors.NoSuchFile,
        errors.InvalidProtobuf,
        errors.InvalidGraph,
        errors.InvalidArgument,
        errors.Fail,
    ) as error:
        raise MotionError(f"weights must be ONNX files of YOLOX and RTMPose, which {path} isn't") from error
    if len(shape) != 4 or not all(isinstance(side, int) for side in shape[2:]):
        raise MotionError(
            f"weights must be models of pictures (1, 3, height, width) of fixed size; {path} takes {shape}"
        )
    return shape[2], shape[3]
