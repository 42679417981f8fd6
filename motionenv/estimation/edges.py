r"""How likely the edges of a picture are, given a pose: outlines of limbs lie on steps of brightness.

Edges are pixels at which the smoothed picture is steep. Each pixel of the picture is d pixels from the nearest one
(Euclidean distance transform). On the outline of the true body d is about Gaussian, but for the share `outliers`
which is as anywhere else; elsewhere d is distributed as over the picture, with the density p_0. So a pixel of outline
at d has

    log-odds = log[(1 - outliers) p_1(d) / p_0(d) + outliers]

(Sidenbladh & Black 2001, section 5, learn both densities; here p_0 is that of the picture itself, so that edges say
the less the more of them there are). The log-likelihood, up to what doesn't hang on the pose, is the sum of log-odds
along the outlines of all limbs: two straight pieces each, and the caps of head, hands and feet.

**Hidden edges.** A piece of outline that has another limb just outside it lies within the body's silhouette: there
may be a step (an arm before the torso) or none (the same arm behind it). Such pieces don't count.

**Tempering.** As `motionenv.estimation.observation`: only `effective` pixels of the body's outline are independent.
"""

import os

import numpy as np

from motionenv.body.skeleton import LIMB_SHIFTS
from motionenv.errors import MotionError
from motionenv.estimation.background import picture
from motionenv.estimation.numeric import as_number
from motionenv.estimation.observation import NOTHING_OBSERVED, ObservationModel, checked_poses, checked_unseen
from motionenv.render._workers import Workers
from motionenv.types import Camera, Skeleton

#: Effective number of independent pixels of a body's outline: about that of masks, for the same shapes err; it
#: wasn't measured by itself, and benchmarks/tracking.py finds masks alone better.
EFFECTIVE = 8.0

_OUTLINE = 3.4  # length of a silhouette's outline, in heights of the body
_FAR = 12  # [pixels] beyond which distances are alike
_SMOOTH = 1.0  # [pixels] standard deviation of the smoothing
_TO_STEP = np.sqrt(2 * np.pi) * _SMOOTH  # slope of a smoothed step of height 1 → 1
_STEP = 0.62  # of a mask's steps: more than a wrong pixel on its own makes, less than an outline
_COLOUR = 12.0  # least step of colours [grey levels]
_ABOVE = 4.0  # times the median step: so that neither noise nor texture makes edges


class EdgeModel:
    """Log-likelihood of a picture's edges given poses.

    Args:
        camera: that took the pictures; known to the agent.
        skeleton: the body of the hypotheses; None takes the average one, `from_height(1.75)`.
        noise: standard deviation of outlines about edges, of the body's shape [m]; at least one pixel.
        outliers: share of the outline that shows no edge.
        effective: how many of the outline's pixels count as independent (see `EFFECTIVE`); None counts them all.
        distance: about how far the body is from the camera [m]; None takes that of the world's origin.
        threads: how many hypotheses are scored at a time, the same results with any number; None is one per core.

    Raises:
        MotionError: an argument out of range.
    """

    def __init__(
        self,
        camera: Camera,
        skeleton: Skeleton | None = None,
        *,
        noise: float = 0.02,
        outliers: float = 0.2,
        effective: float | None = EFFECTIVE,
        distance: float | None = None,
        threads: int | None = None,
    ):
        if not 0 < as_number(outliers) < 1:
            raise MotionError(f"outliers must be a share between 0 and 1, got {outliers!r}")
        if not 0 < as_number(noise) < np.inf:
            raise MotionError(f"noise must be a finite number above 0, got {noise!r}")
        self._geometry = ObservationModel(camera, skeleton, effective=effective, distance=distance, threads=1)
        self.skeleton = self._geometry.skeleton
        self.noise, self.outliers, self.effective, self.distance = noise, outliers, effective, distance
        self.workers = Workers(os.cpu_count() or 1 if threads is None else threads, "estimation")
        self.forget()

    def forget(self) -> None:
        """Drop the observation: a new episode begins."""
        self.odds: np.ndarray | None = None

    @property
    def camera(self) -> Camera:
        """That of the current picture."""
        return self._geometry.camera

    def observe(
        self, *, mask=None, rgb=None, depth=None, background=None, unseen=None, camera: Camera | None = None
    ) -> None:
        """Take in the current picture, one of `mask`, `rgb` and `depth`; it replaces the one before.

        Args:
            mask: (height, width), bool, whole numbers (0 is background), or probabilities of foreground as floats.
            rgb: uint8 (height, width, 3).
            depth: (height, width) [m]; infinite, or 0, where there is no body. Only its outline counts.
            background: (height, width, 3), what `rgb` shows without the body: then only edges that aren't in it count.
            unseen: bool (height, width), where nothing of the body could be seen, for something stands before it;
                edges there, and its own outline, don't count. None is nowhere.
            camera: where the camera is now, if it moves.

        Raises:
            MotionError: none of the three or several, or one of a shape or with numbers that can't be.
        """
        if rgb is None or mask is not None or depth is not None:
            self._geometry.observe(mask=mask, rgb=rgb, depth=depth, background=background, unseen=unseen, camera=camera)
            nothing = unseen
            edges = _TO_STEP * steepness(self._geometry.foreground) > _STEP
        else:
            colours = picture(rgb).astype(np.float32)
            camera = self.camera if camera is None else camera
            size = (camera.height, camera.width)
            for name, shape in (("rgb", colours.shape), ("background", np.shape(background))):
                if shape != (*size, 3) and not (name == "background" and background is None):
                    raise MotionError(f"{name} must be of the camera's size {(*size, 3)}, got {shape}")
            nothing = None if unseen is None else checked_unseen(unseen, size)
            self._geometry.look(camera)
            step = _TO_STEP * steepness(colours if background is None else colours - np.asarray(background, np.float32))
            edges = step > max(_COLOUR, _ABOVE * float(np.median(step)))
        self.odds = self._log_odds(edges, nothing)

    @property
    def temper(self) -> float:
        """What sums over the outline's pixels are multiplied with, at most 1."""
        if self.effective is None:
            return 1.0
        return min(1.0, self.effective / (_OUTLINE * self.skeleton.height * self._scale))

    def log_likelihood(self, poses) -> np.ndarray:
        """Log-likelihood (N,) of the current edges given each of `poses` (N, 25) [m, rad], up to a constant.

        Raises:
            MotionError: nothing observed yet, poses of another shape, or numbers that aren't finite.
        """
        if self.odds is None:
            raise MotionError(NOTHING_OBSERVED)
        nothing = np.zeros_like(self.odds)
        return self.temper * outline_sums(self, nothing, self.odds, poses, self.workers)[1]

    @property
    def view(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """R, t, K and its inverse for `body_sums`, so turned that K is upper triangular."""
        return self._geometry.view

    @property
    def _scale(self) -> float:
        """Pixels per metre at the body."""
        return self._geometry.scale

    def _log_odds(self, edges: np.ndarray, unseen: np.ndarray | None) -> np.ndarray:
        """Log-odds of outline at each pixel, given edge pixels and where nothing can be seen (height, width)."""
        from scipy import ndimage

        if unseen is not None:
            # The edge of what is in the way is smoothed over some pixels.
            edges = edges & ~ndimage.binary_dilation(unseen, iterations=2)
        if not edges.any():
            return np.zeros(edges.shape)
        distance = np.minimum(ndimage.distance_transform_edt(~edges), _FAR).astype(np.int64)
        there = np.bincount(distance.ravel(), minlength=_FAR + 1) + 1.0
        sigma = max(1.0, self.noise * self._scale)
        right = np.exp(-0.5 * (np.arange(_FAR + 1) / sigma) ** 2)
        ratio = (right / right.sum()) / (there / there.sum())
        odds = np.log((1 - self.outliers) * ratio + self.outliers)[distance]
        return odds if unseen is None else np.where(unseen, 0.0, odds)


def outline_sums(
    model: EdgeModel, inside: np.ndarray, along: np.ndarray, poses, workers: Workers
) -> tuple[np.ndarray, np.ndarray]:
    """Sums under silhouettes (N,) and along outlines (N,) in one pass over each body.

    Args:
        model: whose view and skeleton are taken.
        inside: (height, width), per pixel of silhouette.
        along: (height, width), per pixel of outline.
        poses: (N, 25) [m, rad].
        workers: that share the work.
    """
    from motionenv.estimation._edge_kernel import body_sums

    poses = checked_poses(poses)
    out = np.empty((2, len(poses)))

    body = model.skeleton
    about = (body.offsets, LIMB_SHIFTS, body.height, body.radii, *model.view, inside, along)

    def work(start: int, stop: int) -> None:
        body_sums(poses[start:stop], *about, out[0, start:stop], out[1, start:stop])

    workers.share(work, len(poses))
    return out[0], out[1]


def steepness(values: np.ndarray) -> np.ndarray:
    """Length (height, width) of the gradient of smoothed values (height, width) or (height, width, channels).

    Args:
        values: a picture.
    """
    from scipy import ndimage

    values = np.atleast_3d(values)
    smooth = (_SMOOTH, _SMOOTH)
    squares = [
        ndimage.gaussian_filter(values[..., i], smooth, order=order, mode="nearest") ** 2
        for i in range(values.shape[2])
        for order in ((0, 1), (1, 0))
    ]
    return np.sqrt(np.sum(squares, axis=0))
