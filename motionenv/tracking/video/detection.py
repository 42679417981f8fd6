"""Detect the person in a video, and guess an unknown camera.

An unknown camera is assumed to be static, at eye height, with a common focal length, and to see a person of average
height cross the image. A person of height H whose outline is h pixels high and ends in row b is at distance f H / h; a
horizon in row r puts the camera e = H (b - r) / h above the ground. A level camera has its horizon in the image centre;
if that implies an implausible camera height, the camera is tilted instead.
"""

import numpy as np

from motionenv.errors import MotionError
from motionenv.render.cameras import look_at
from motionenv.tracking.initialization import bounding_box
from motionenv.types import Camera, Skeleton

_FOCAL = 1.0  # focal length relative to the longer image side; phones have 0.75, camcorders more
_EYES = (0.8, 1.9)  # [m] plausible heights of a level camera
_USUAL_EYES = 1.5  # [m] assumed height of a tilted camera
_LEAST_HEIGHT, _LEAST_AREA = 0.12, 0.002  # least size of a person, relative to the image's height and area
_LEAST_PERSON, _MOST_PERSON = 1.0, 2.3  # [m]
_STEADY = 5  # least number of consecutive frames
_WHOLE = 0.85  # least height of a complete outline, relative to the typical one
_SOON, _STEP = 0.5, 0.08  # a walker moves at least _STEP body heights in _SOON seconds


def detections(foregrounds) -> np.ndarray:
    """Bounding boxes of outlines (T, 4): first and last column, first and last row; NaN where no person is detected.

    Args:
        foregrounds: (T, height, width) probabilities.
    """
    boxes = np.full((len(foregrounds), 4), np.nan)
    for i, foreground in enumerate(foregrounds):
        if (foreground > 0.5).mean() < _LEAST_AREA:
            continue
        try:
            box = bounding_box(foreground)
        except MotionError:
            continue
        if box[3] - box[2] >= _LEAST_HEIGHT * foreground.shape[0]:
            boxes[i] = box
    return boxes


def span(boxes: np.ndarray, width: int) -> tuple[int, int]:
    """First frame with a complete person away from the image's sides, and one past the last such frame.

    Args:
        boxes: (T, 4), see `detections`.
        width: of the images [pixels].

    Raises:
        MotionError: no person is seen for long enough.
    """
    seen = np.isfinite(boxes[:, 0])
    whole = seen & (boxes[:, 0] > 1) & (boxes[:, 1] < width - 2)
    runs = np.convolve(whole, np.ones(_STEADY), mode="valid") if len(whole) >= _STEADY else np.zeros(0)
    starts = np.flatnonzero(runs >= _STEADY)
    if not len(starts):
        raise MotionError(
            f"no foreground: no {_STEADY} consecutive frames show a complete moving person; the camera must be static, "
            "and the person must cross the image"
        )
    return int(starts[0]), int(np.flatnonzero(whole)[-1]) + 1


def departure_frame(boxes: np.ndarray, fps: float) -> int:
    """First frame from which a completely visible person walks; 0 if there is none.

    Args:
        boxes: (T, 4), see `detections`.
        fps: frame rate [Hz].
    """
    tall = boxes[:, 3] - boxes[:, 2]
    soon = max(1, round(_SOON * fps))
    middle = boxes[:, :2].mean(axis=-1)
    moved = np.abs(middle[soon:] - middle[:-soon])  # NaN where a box is missing, which compares as False
    walks = (moved > _STEP * np.nanmedian(tall)) & (tall > _WHOLE * np.nanmedian(tall))[:-soon]
    return int(np.argmax(walks)) if walks.any() else 0


def side_camera(boxes: np.ndarray, skeleton: Skeleton, width: int, height: int) -> Camera:
    """A camera that sees a standing person on the ground in the boxes; the world's origin projects to the image centre.

    Args:
        boxes: (T, 4) [pixels]; NaN rows are ignored.
        skeleton: of the person.
        width: of the images [pixels].
        height: of the images [pixels].

    Raises:
        MotionError: no box.
    """
    boxes = boxes[np.isfinite(boxes).all(axis=-1)]
    if not len(boxes):
        raise MotionError("no person was detected, so the camera can't be guessed: give a camera")
    tall, feet = np.median(boxes[:, 3] - boxes[:, 2] + 1), np.median(boxes[:, 3])
    focal = _FOCAL * max(width, height)
    distance = focal * skeleton.height / tall
    middle = (height - 1) / 2
    eyes = skeleton.height * (feet - middle) / tall
    eyes = eyes if _EYES[0] <= eyes <= _EYES[1] else _USUAL_EYES
    horizon = feet - eyes * tall / skeleton.height
    drop = distance * (middle - horizon) / focal
    fov = np.degrees(2 * np.arctan(0.5 * height / focal))
    return look_at((0, -distance, eyes), (0, 0, eyes - drop), width=width, height=height, fov_degrees=float(fov))


def resized(camera: Camera, width: int, height: int) -> Camera:
    """The same camera for images of another size.

    Args:
        camera: the camera.
        width: of the images [pixels].
        height: of the images [pixels].

    Raises:
        MotionError: the aspect ratio differs.
    """
    scale = np.array([width / camera.width, height / camera.height])
    if abs(camera.width * scale[1] - width) > 1.5 + 0.01 * width:
        raise MotionError(
            f"camera has images of {camera.width} x {camera.height}, but the video has {width} x {height}: the aspect "
            "ratios must agree"
        )
    K = camera.K.copy()
    K[:2, 2] += 0.5
    K[:2] *= scale[:, None]
    K[:2, 2] -= 0.5
    return Camera(K, camera.R, camera.t, width, height)


def standing_height(boxes: np.ndarray, camera: Camera) -> float:
    """Body height [m] of a person who stands or walks on the ground in the boxes of a known camera.

    The ray through a box's lower edge meets the ground at the feet, and the ray through its upper edge passes the top
    of the head above them. Errors from the nearer foot and from strides cancel to within a few per cent.

    Args:
        boxes: (T, 4) [pixels]; NaN rows are ignored.
        camera: of the same images.

    Raises:
        MotionError: the boxes can't be a person on this camera's ground.
    """
    boxes = boxes[np.isfinite(boxes).all(axis=-1)]
    middle, ones = boxes[:, :2].mean(axis=1), np.ones(len(boxes))
    feet, crown = (np.stack([middle, row, ones], -1) for row in (boxes[:, 3] + 0.5, boxes[:, 2] - 0.5))
    down, up = (pixels @ np.linalg.inv(camera.K).T @ camera.R for pixels in (feet, crown))
    centre = camera.centre
    with np.errstate(divide="ignore", invalid="ignore"):
        far = np.hypot(*(down[:, :2] * (-centre[2] / down[:, 2:])).T)
        heights = centre[2] + up[:, 2] * far / np.hypot(*up[:, :2].T)
    height = float(np.median(heights[down[:, 2] < 0])) if (down[:, 2] < 0).any() else np.nan
    if not _LEAST_PERSON <= height <= _MOST_PERSON:
        raise MotionError(
            f"the moving person would be {height:.2f} m tall if standing on the ground z = 0 of this camera: check the "
            "camera, or give the height"
        )
    return height
