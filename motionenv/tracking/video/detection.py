"""When a person is in a video, how tall, and a guess of an unknown camera.

An unknown camera is assumed to be static, with a common focal length, and to see a person of average height. A person
of height H whose outline is h pixels high and ends in row b is at distance f H / h. A camera e above the ground whose
horizon is in row r sees b = r + (e / H) h: where h varies, as somebody comes nearer, the boxes tell both r and e; where
it doesn't, assumptions of both decide, a camera at eye height that is about level.
"""

import numpy as np

from motionenv.errors import MotionError
from motionenv.render.cameras import look_at
from motionenv.types import Camera, Skeleton

_FOCAL = 1.0  # focal length relative to the longer image side; phones have 0.75, camcorders more
_EYES = (1.5, 0.4)  # [m] mean and standard deviation of the camera's height
_TILT = 0.15  # [rad] standard deviation of its tilt
_GAIT = 0.04  # standard deviation of an outline's lower end, relative to its height; a film counts as _FRAMES of these
_FRAMES, _ROUNDS = 10, 5  # and the number of rounds in which outliers lose their weight
_LEAST_PERSON, _USUAL_PERSON, _MOST_PERSON = 1.0, 1.75, 2.3  # [m]
_STEADY = 5  # least number of consecutive frames


def span(boxes: np.ndarray, width: int) -> tuple[int, int]:
    """First frame with a complete person away from the sides of images `width` wide, and one past the last such frame.

    `boxes` (T, 4) are first and last column, first and last row [pixels]; NaN where the person isn't seen.

    Raises:
        MotionError: no person is seen for long enough.
    """
    seen = np.isfinite(boxes[:, 0])
    whole = seen & (boxes[:, 0] > 1) & (boxes[:, 1] < width - 2)
    runs = np.convolve(whole, np.ones(_STEADY), mode="valid") if len(whole) >= _STEADY else np.zeros(0)
    starts = np.flatnonzero(runs >= _STEADY)
    if not len(starts):
        raise MotionError(
            f"no {_STEADY} consecutive frames show the whole person, away from the picture's sides: use a longer film, "
            "or choose somebody else by person, box or point"
        )
    return int(starts[0]), int(np.flatnonzero(whole)[-1]) + 1


def side_camera(boxes: np.ndarray, skeleton: Skeleton, width: int, height: int) -> Camera:
    """A camera that sees a standing person on the ground in the boxes; the world's origin projects to the image centre.

    Args:
        boxes: (T, 4) [pixels]; NaN rows are ignored.
        skeleton: of the person.
        width, height: of the images [pixels].

    Raises:
        MotionError: no box.
    """
    boxes = boxes[np.isfinite(boxes).all(axis=-1)]
    if not len(boxes):
        raise MotionError("no person was detected, so the camera can't be guessed: give a camera")
    whole = (boxes[:, 2] > 1) & (boxes[:, 3] < height - 2)
    boxes = boxes[whole] if whole.any() else boxes
    tall = boxes[:, 3] - boxes[:, 2] + 1
    focal = _FOCAL * max(width, height)
    distance = focal * skeleton.height / np.median(tall)
    middle = (height - 1) / 2
    horizon, eyes = _horizon(tall, boxes[:, 3], middle, focal, skeleton.height)
    fov = np.degrees(2 * np.arctan(0.5 * height / focal))
    drop = distance * (middle - horizon) / focal
    return look_at((0, -distance, eyes), (0, 0, eyes - drop), width=width, height=height, fov_degrees=float(fov))


def _horizon(tall: np.ndarray, feet: np.ndarray, middle: float, focal: float, stature: float) -> tuple[float, float]:
    """Row of the horizon and height of the camera [m], from outlines' heights and lower ends (T,) [pixels].

    The most probable ones, with weights of a Cauchy distribution; `middle` is the image centre's row.
    """
    likely, spread = np.array([middle, _EYES[0] / stature]), np.array([focal * _TILT, _EYES[1] / stature])
    found, terms, weights = likely, np.stack([np.ones(len(tall)), tall], axis=1), np.ones(len(tall))
    for _ in range(_ROUNDS):
        scaled = terms * (weights * min(1, _FRAMES / len(tall)) / (_GAIT * tall) ** 2)[:, None]
        found = np.linalg.solve(scaled.T @ terms + np.diag(spread**-2.0), scaled.T @ feet + likely / spread**2)
        weights = 1 / (1 + ((feet - terms @ found) / (_GAIT * tall)) ** 2)
    return float(found[0]), float(found[1] * stature)


def resized(camera: Camera, width: int, height: int) -> Camera:
    """The same `camera` for images of another `width` and `height` [pixels].

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
    """Body height [m] of a person who stands or walks on the ground in `boxes` (T, 4) of a known `camera` [pixels].

    The ray through a box's lower edge meets the ground at the feet, and the ray through its upper edge passes the top
    of the head above them. Errors from the nearer foot and from strides cancel to within a few per cent. NaN rows are
    ignored.

    Raises:
        MotionError: the boxes can't be a person on this camera's ground.
    """
    boxes = boxes[np.isfinite(boxes).all(axis=-1)]
    middle, ones = boxes[:, :2].mean(axis=1), np.ones(len(boxes))
    feet, crown = (np.stack([middle, row, ones], -1) for row in (boxes[:, 3] + 0.5, boxes[:, 2] - 0.5))
    down, up = (pixels @ np.linalg.inv(camera.K).T @ camera.R for pixels in (feet, crown))
    centre = camera.centre
    ahead = down[:, 2] < 0
    if centre[2] <= 0 or not ahead.any():
        x, y, z = centre
        where = "below the ground" if centre[2] <= 0 else "and sees the person's feet above its horizon"
        raise MotionError(
            f"the camera contradicts the picture: it's at ({x:.2f}, {y:.2f}, {z:.2f}) m, {where}. The ground must be "
            "z = 0 with z up, R and t must map the world to the camera (x right, y down, z forward); many files hold "
            "the inverse, or y up. Check the file, or leave the camera out to have it guessed"
        )
    far = np.hypot(*(down[ahead, :2] * (-centre[2] / down[ahead, 2:])).T)
    height = float(np.median(centre[2] + up[ahead, 2] * far / np.hypot(*up[ahead, :2].T)))
    if not _LEAST_PERSON <= height <= _MOST_PERSON:
        raise MotionError(
            f"the camera contradicts the picture: whom it shows would be {height:.2f} m tall, standing on the ground "
            f"z = 0, {np.median(far):.1f} m away from a "
            f"camera {centre[2]:.2f} m high. If the person isn't on the ground, give the height; else check the unit "
            f"(times {_USUAL_PERSON / height:.3g} would suit), the focal length and the picture's size, or leave the "
            "camera out to have it guessed"
        )
    return height
