"""Where in a film somebody is seen, and what camera that may have been, where nobody knows.

An unknown camera is taken for one that stands still at about the height of the eyes and sees somebody of average
height cross its picture (focal length as common cameras have it). A person of height H whose outline is h pixels high
and ends in row b is at the distance f H / h; a horizon in row r puts the camera e = H (b - r) / h above the ground. A
level camera has its horizon in the middle; if that would put it unusually high or low, it is tilted instead.
"""

import numpy as np

from motionenv.errors import MotionError
from motionenv.estimation.tracking.start import bounding_box
from motionenv.render.cameras import look_at
from motionenv.types import Camera, Skeleton

_FOCAL = 1.0  # of the picture's longer side; main cameras of telephones have 0.75, camcorders more
_EYES = (0.8, 1.9)  # [m] heights of a camera that isn't thought to be tilted
_USUAL_EYES = 1.5  # [m]
_LEAST_HEIGHT, _LEAST_AREA = 0.12, 0.002  # of the picture's height and area, that a person takes
_LEAST_PERSON, _MOST_PERSON = 1.0, 2.3  # [m]
_STEADY = 5  # frames on end
_WHOLE = 0.85  # of the usual outline's height, from where on it is thought to be whole
_SOON, _STEP = 0.5, 0.08  # [s] and heights, by which walkers move on in them


def sightings(foregrounds) -> np.ndarray:
    """Outlines' boxes (T, 4): first and last column, first and last row; NaN where nobody large enough is seen.

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
    """First frame from which somebody is seen whole, away from the picture's sides, and one past the last one seen.

    Args:
        boxes: (T, 4), see `sightings`.
        width: of the pictures [pixels].

    Raises:
        MotionError: nobody is seen for long enough.
    """
    seen = np.isfinite(boxes[:, 0])
    whole = seen & (boxes[:, 0] > 1) & (boxes[:, 1] < width - 2)
    runs = np.convolve(whole, np.ones(_STEADY), mode="valid") if len(whole) >= _STEADY else np.zeros(0)
    starts = np.flatnonzero(runs >= _STEADY)
    if not len(starts):
        raise MotionError(
            f"no foreground: in no {_STEADY} frames on end does somebody move, whole, before a background that keeps "
            "still; the camera must stand still, and the person cross the picture"
        )
    return int(starts[0]), int(np.flatnonzero(whole)[-1]) + 1


def departure(boxes: np.ndarray, fps: float) -> int:
    """First frame from which on somebody, seen whole, walks; 0 where none is.

    Args:
        boxes: (T, 4), see `sightings`.
        fps: frames per second.
    """
    tall = boxes[:, 3] - boxes[:, 2]
    soon = max(1, round(_SOON * fps))
    middle = boxes[:, :2].mean(axis=-1)
    moved = np.abs(middle[soon:] - middle[:-soon])  # NaN compares as False
    walks = (moved > _STEP * np.nanmedian(tall)) & (tall > _WHOLE * np.nanmedian(tall))[:-soon]
    return int(np.argmax(walks)) if walks.any() else 0


def side_camera(boxes: np.ndarray, skeleton: Skeleton, width: int, height: int) -> Camera:
    """A camera that sees a standing person on the ground in the boxes; the world's origin is in the picture's middle.

    Args:
        boxes: (T, 4) [pixels], NaN rows are left out.
        skeleton: of the person.
        width: of the pictures [pixels].
        height: of the pictures [pixels].

    Raises:
        MotionError: no box.
    """
    boxes = boxes[np.isfinite(boxes).all(axis=-1)]
    if not len(boxes):
        raise MotionError("nobody is seen: a camera can't be guessed without an outline")
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
    """The same view in pictures of another size.

    Args:
        camera: the view.
        width: of the pictures [pixels].
        height: of the pictures [pixels].

    Raises:
        MotionError: of other proportions.
    """
    scale = np.array([width / camera.width, height / camera.height])
    if abs(camera.width * scale[1] - width) > 1.5 + 0.01 * width:
        raise MotionError(
            f"the camera's pictures are {camera.width} x {camera.height}, which doesn't go with {width} x {height}: "
            "take the camera that made the film"
        )
    K = camera.K.copy()
    K[:2, 2] += 0.5
    K[:2] *= scale[:, None]
    K[:2, 2] -= 0.5
    return Camera(K, camera.R, camera.t, width, height)


def standing_height(boxes: np.ndarray, camera: Camera) -> float:
    """Height [m] of whoever stands or walks on the ground in the boxes of a known camera.

    The ray through a box's lower edge meets the ground where the feet are, the one through its upper edge passes the
    crown above them. Feet that are nearer than the body, and strides, make up for each other but for some per cent.

    Args:
        boxes: (T, 4) [pixels], NaN rows are left out.
        camera: of the same pictures.

    Raises:
        MotionError: what the boxes show can't be a person on this camera's ground.
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
            f"what moves is {height:.2f} m high by this camera, as if standing on its ground z = 0: check the camera, "
            "or give the height"
        )
    return height
