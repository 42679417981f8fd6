"""RTMPose (Jiang et al. 2023, arXiv:2303.07399): everybody's 26 keypoints of Halpe, body with feet, by RTMLib.

RTMLib (https://github.com/Tau-J/rtmlib) finds people with YOLOX, and downloads the published models' weights (Apache
2.0) when they are first used; needs `motionenv[rtmpose]`.
"""

import io
import zipfile
from contextlib import redirect_stdout
from pathlib import Path
from typing import Any

import numpy as np

from motionenv.errors import MotionError


class RTMPose:
    """Sees people in pictures.

    `weights` is a folder with ONNX files of a YOLOX detector of people, with "yolox" in its name, and of an RTMPose
    model; None downloads published ones.

    Raises:
        MotionError: they can't be had or used.
        ImportError: RTMLib isn't installed.
    """

    def __init__(self, weights: str | Path | None = None) -> None:
        self._people, self._pose = _models(weights)

    def __call__(self, picture: np.ndarray) -> list[np.ndarray]:
        """Keypoints (26, 3), x, y [pixels] and score, of everybody in a `picture`, uint8 (height, width, 3)."""
        backwards = np.ascontiguousarray(picture[..., ::-1])  # RTMLib's pictures are BGR, as OpenCV's
        boxes = self._people(backwards)
        if not len(boxes):  # RTMPose would take the whole picture for somebody
            return []
        places, scores = self._pose(backwards, bboxes=boxes)
        return [np.column_stack([*each]).astype(float) for each in zip(places, scores, strict=True)]


def _models(weights: str | Path | None) -> tuple[Any, Any]:
    from onnxruntime.capi import onnxruntime_pybind11_state as onnx
    from rtmlib import YOLOX, BodyWithFeet
    from rtmlib import RTMPose as Pose

    unusable = onnx.Fail, onnx.InvalidArgument, onnx.InvalidGraph, onnx.InvalidProtobuf, onnx.NoSuchFile
    known = BodyWithFeet.MODE["balanced"]
    files = [known["det"], known["pose"]]
    try:
        if weights is not None:
            files = sorted(map(str, Path(weights).glob("*.onnx")), key=lambda path: "yolox" not in Path(path).name)
            if len(files) != 2 or "yolox" not in Path(files[0]).name:
                raise ValueError(f"it has {files}")
        with redirect_stdout(io.StringIO()):  # it tells which files it loads
            people = YOLOX(files[0], model_input_size=known["det_input_size"])
            pose = Pose(files[1], model_input_size=known["pose_input_size"])
        if weights is not None:
            people.model_input_size, pose.model_input_size = _side(people), _side(pose)[::-1]
    except (OSError, RuntimeError, UnboundLocalError, ValueError, zipfile.BadZipFile, *unusable) as error:
        problem = "can't be downloaded: connect to the internet once, or give them"
        raise MotionError(
            f"RTMPose's weights {problem if weights is None else f'{weights} are of no use'}: they must be a folder "
            f"(--weights) with an ONNX file of YOLOX, named so, and one of RTMPose, for pictures of one size"
        ) from error
    return people, pose


def _side(model: Any) -> tuple[int, int]:
    """Height and width of the pictures that a model takes; raises ValueError if it leaves them open."""
    _, _, rows, columns = model.session.get_inputs()[0].shape
    return int(rows), int(columns)
