"""How the camera of a film moves, from the background: it stands still, turns, or moves in another way.

Each picture is aligned with the key, an earlier picture, whose orientation is nearest: errors don't add up over time,
only over the field of view. Where the pictures turn but blocks of the background are elsewhere than the turn puts them,
there is parallax or zoom: the camera changes its place or its lens, which a turn can't undo.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import minimize_scalar
from scipy.spatial.transform import Rotation

from motionenv._core.representation import OneLine
from motionenv.errors import MotionError
from motionenv.lifting.free.rays import undistorted
from motionenv.lifting.picture_alignment import Fit, View, aligned, fit_of, stepped
from motionenv.render.video.decode import narrowed
from motionenv.types import Points

#: Share of the background's blocks that agree with a camera that only turns, where all people are left out.
AGREE = 0.9
_SIDE = 256  # [pixels] longer side of the pictures that are aligned
_REACH = 0.4  # of the shorter side, by which a picture may be shifted from its key
_FEWEST = 8  # blocks that must be able to tell
_LEAST, _MOSTLY, _LOST = 0.7, 0.1, 0.5  # share of blocks that agree; of frames in which fewer may; lost with fewer
_STILL = 0.25  # [pixels] rms shift of a camera that stands still
_FOCAL, _FOCAL_DEVIATION = 1.0, 0.35  # of unknown cameras, in longer sides: median, and deviation of the logarithm
_FOCALS = (-0.8, 0.8)  # logarithms, relative to that
_CLOSE = {"xatol": 0.01}
_PAIRS, _ALIKE = 5, 10.0  # pairs of pictures that tell the focal length; neighbouring pixels whose residuals are alike


@dataclass(frozen=True, eq=False, repr=False)
class CameraMotion(OneLine):
    """How a camera moves.

    Attributes:
        kind: "still"; "turns", by `rotations`; "moves", in another way, or so that it can't be told how; or "unknown",
            as the background has too little structure.
        rotations: (frames, 3, 3) from the camera's axes in the first frame to those in each; the identity unless it
            turns.
        inner: intrinsics (3, 3) [pixels], given or found.
        degrees: greatest angle from the first frame's orientation, as far as it can be told.
        agree: share of the background's blocks that are where the rotations put them, in the worst tenth of the frames.
    """

    kind: str
    rotations: np.ndarray
    inner: np.ndarray
    degrees: float
    agree: float

    @property
    def doubtful(self) -> bool:
        """Whether too little of the background agrees with the turns: perhaps the camera is carried along, or zooms."""
        return self.kind == "moves" or (self.kind == "turns" and self.agree < AGREE)

    def steadied(self, points: Points, *, distortion: Sequence[float] | None = None, level: bool = True) -> Points:
        """The points as a camera that stands still would see them, with the intrinsics `inner` and no distortion.

        Args:
            points: in pixels of the film.
            distortion: as in `lift`.
            level: whether it stands as the camera does on average; else as in the first frame.

        Raises:
            MotionError: other frames, or points that such a camera can't see.
        """
        if len(points.positions) != len(self.rotations):
            raise MotionError(f"points must have the film's {len(self.rotations)} frames, got {len(points.positions)}")
        if self.kind != "turns":
            return points
        turned = Rotation.from_matrix(self.rotations)
        turned = turned * turned.mean().inv() if level else turned
        shown = points.positions if points.feet is None else np.concatenate([points.positions, points.feet], axis=1)
        flat = np.insert(shown, 2, 1.0, axis=-1) @ np.linalg.inv(self.inner).T
        if distortion is not None:
            flat[..., :2] = undistorted(flat[..., :2], distortion)
        seen = flat @ turned.as_matrix() @ self.inner.T
        if (seen[..., 2] <= 0).any():
            raise MotionError(f"the camera turns by {self.degrees:.0f} degrees, too far for one view: cut the film")
        places, feet = np.split(seen[..., :2] / seen[..., 2:], [points.positions.shape[1]], axis=1)
        return replace(points, positions=places, feet=None if points.feet is None else feet)


def camera_motion(
    frames: Iterable[np.ndarray], people: Sequence[ArrayLike] | None = None, inner: np.ndarray | None = None, *,
    width: int | None = None,
) -> CameraMotion:  # fmt: skip
    """How the camera of a film moves.

    Args:
        frames: pictures, uint8 (height, width, 3), one after the other.
        people: for each frame the boxes (n, 4) of people, x0, y0, x1, y1 [pixels], which are left out. Without them,
            they may cover a third of the picture.
        inner: intrinsics (3, 3) [pixels]; None finds the focal length by the turns.
        width: of the pictures in whose pixels `people` and `inner` are [pixels]; None is that of the frames.
            Frames 256 pixels wide or high are large enough.

    Raises:
        MotionError: no frame, fewer `people` than frames, or frames without `inner` that can't be read twice.
    """
    if inner is None and iter(frames) is frames:
        raise MotionError("frames must be readable twice, such as a list, if inner isn't given; got an iterator")
    track = _Track(frames, people, inner, width)
    kind = track.kind()
    if kind in ("turns", "moves") and inner is None:
        track = _Track(frames, people, track.calibrated(), width)
        kind = track.kind()
    turned = Rotation.concatenate(track.poses)
    degrees = float(np.degrees(turned.magnitude().max()))
    rotations = turned.as_matrix() if kind == "turns" else np.tile(np.eye(3), (len(track.poses), 1, 1))
    return CameraMotion(kind, rotations, track.whole, degrees, track.agree())


class _Track:
    """The camera's orientation in each of the `frames`; arguments are those of `camera_motion`."""

    def __init__(self, frames: Iterable[np.ndarray], people, inner: np.ndarray | None, width: int | None) -> None:
        self.people, self.given, self.width = people, inner, width
        self.poses: list[Rotation] = []
        self.fits: list[Fit] = []
        self.keys: list[tuple[View, Rotation]] = []
        self.pairs: list[tuple[View, View, Rotation]] = []  # that are turned most against each other
        self.noise, self.velocity = np.inf, Rotation.identity()
        for picture in frames:
            view = self._view(picture)
            if not self.poses:
                self.poses, self.keys = [Rotation.identity()], [(view, Rotation.identity())]
                self.fits = [fit_of(view, view, Rotation.identity(), self.inner)]
            else:
                self._align(view)
            self.last = view, self.poses[-1]
        if not self.poses:
            raise MotionError("frames must hold at least one picture, got none")

    def _align(self, view: View) -> None:
        guess = self.velocity * self.poses[-1]
        near = min(self.keys, key=lambda key: (guess * key[1].inv()).magnitude())
        if (guess * near[1].inv()).magnitude() * self.inner[0, 0] > _REACH * min(view.shape):
            near = self.last
            self.keys.append(near)
        turn, fit = self._fitted(view, near, guess)
        if fit.blocks < 2 * _FEWEST and near is not self.last:  # people hide the rest
            self.keys = [*(key for key in self.keys if key is not near), self.last]
            turn, fit = self._fitted(view, near := self.last, guess)
        self.noise = fit.noise
        now = turn * near[1]
        self.velocity = now * self.poses[-1].inv() if fit.agree > _LOST else Rotation.identity()
        self.poses.append(now)
        self.fits.append(fit)
        self.pairs = sorted([*self.pairs, (view, near[0], turn)], key=lambda pair: -pair[2].magnitude())[:_PAIRS]

    def _fitted(self, view: View, near: tuple[View, Rotation], guess: Rotation) -> tuple[Rotation, Fit]:
        """The turn of a view from a key near a guess of its orientation, and how well that fits."""
        key, start = near[0], guess * near[1].inv()
        turn, done = stepped(view, key, start, self.inner)
        fit = fit_of(view, key, turn, self.inner, self.noise)
        if not done or fit.agree <= AGREE:
            turn = aligned(view, key, start, self.inner)
            fit = fit_of(view, key, turn, self.inner, self.noise)
        return turn, fit

    def _view(self, picture: np.ndarray) -> View:
        """The picture as it's aligned, and the intrinsics for that."""
        high, wide = picture.shape[:2]
        width = round(wide * min(1.0, _SIDE / max(high, wide)))
        scale = width / (self.width or wide)
        x, y = width / scale, high * width / wide / scale
        guess = np.array([[_FOCAL * max(x, y), 0, x / 2 - 0.5], [0, _FOCAL * max(x, y), y / 2 - 0.5], [0, 0, 1]])
        self.whole = guess if self.given is None else self.given
        self.inner = self.whole * [[scale], [scale], [1]]
        self.inner[:2, 2] += 0.5 * (scale - 1)
        if self.people is not None and len(self.people) <= len(self.poses):
            raise MotionError(f"people must have boxes for each frame, got those of {len(self.people)}")
        boxes = () if self.people is None else np.asarray(self.people[len(self.poses)]) * scale
        return View(picture if width == wide else narrowed(picture, width), boxes)

    def agree(self) -> float:
        """Share of blocks that agree, in the worst tenth of the frames."""
        return float(np.quantile([fit.agree for fit in self.fits], _MOSTLY))

    def kind(self) -> str:
        """What `CameraMotion.kind` tells."""
        if np.median([fit.blocks for fit in self.fits]) < _FEWEST:
            return "unknown"
        turns = Rotation.concatenate(self.poses)
        shift = (turns * turns.mean().inv()).magnitude() * self.inner[0, 0]
        if self.agree() > _LOST and np.sqrt((shift**2).mean()) < _STILL:
            return "still"
        return "turns" if self.agree() > _LEAST else "moves"

    def calibrated(self) -> np.ndarray:
        """Intrinsics whose focal length aligns the pictures of the pairs best, and is likely."""

        def cost(factor: float) -> float:
            inner = self.inner * [[factor], [factor], [1]]
            inner[:2, 2] = self.inner[:2, 2]
            total = 0.5 * (np.log(factor) / _FOCAL_DEVIATION) ** 2
            for view, key, turn in self.pairs:
                turned = aligned(view, key, Rotation.from_rotvec(turn.as_rotvec() / [factor, factor, 1]), inner)
                total += fit_of(view, key, turned, inner, self.noise).loss / _ALIKE
            return total

        found = minimize_scalar(lambda log: cost(np.exp(log)), bounds=_FOCALS, method="bounded", options=_CLOSE)
        inner = self.whole * np.exp([[found.x], [found.x], [0]])
        inner[:2, 2] = self.whole[:2, 2]
        return inner
