r"""Edge likelihood: outlines of limbs coincide with brightness steps.

Edges are pixels with a steep gradient of the smoothed image. Each pixel has a distance d to the nearest edge (Euclidean
distance transform). On the true outline, d is about Gaussian, apart from a fraction `outliers`; elsewhere d has the
density p_0 of the whole image. An outline pixel therefore has

    log-odds = log[(1 - outliers) p_1(d) / p_0(d) + outliers]

(Sidenbladh & Black 2001, section 5, learn both densities; here p_0 comes from the image itself, so that clutter reduces
the information.) The log-likelihood, up to a constant, is the sum of log-odds along the outlines of all limbs: two
straight pieces each, and the caps of head, hands and feet.

**Inner edges.** An outline piece with another limb just outside lies within the body's silhouette. It may show a step
(an arm in front of the torso) or none (the same arm behind it), and doesn't count.

**Tempering.** As in `motionenv.likelihoods.silhouette`: only `effective` pixels of the outline are independent.
"""

import numpy as np

from motionenv._core.threads import Workers
from motionenv._core.validation import checked_number
from motionenv.body.skeleton import LIMB_SHIFTS
from motionenv.errors import MotionError
from motionenv.likelihoods.background import picture
from motionenv.likelihoods.silhouette import NOTHING_OBSERVED, SilhouetteLikelihood, checked_poses, checked_unseen
from motionenv.types import Camera, Skeleton

#: Effective number of independent pixels of a body's outline: about that of masks, because both err with the body's
#: shape. Not measured separately; benchmarks/tracking/ finds masks alone better.
EFFECTIVE = 8.0

_OUTLINE = 3.4  # length of a silhouette's outline, in body heights
_FAR = 12  # [pixels] distances are clipped to this
_SMOOTH = 1.0  # [pixels] standard deviation of the smoothing
_TO_STEP = np.sqrt(2 * np.pi) * _SMOOTH  # slope of a smoothed step of height 1 → 1
_STEP = 0.62  # least step in masks: more than a single wrong pixel causes, less than an outline
_COLOUR = 12.0  # least step of colours [grey levels]
_ABOVE = 4.0  # least step relative to the median, to exclude noise and texture


class EdgeLikelihood:
    """Log-likelihood of an image's edges given poses.

    Args:
        camera: of the images.
        skeleton: the body of the hypotheses; None uses the average one, `from_height(1.75)`.
        noise: standard deviation of outlines about edges, because of the body's shape [m]; at least one pixel.
        outliers: fraction of the outline without an edge.
        effective: effective number of independent outline pixels (see `EFFECTIVE`); None counts all pixels.
        distance: approximate distance of the body from the camera [m]; None uses that of the world's origin.
        threads: number of threads, which doesn't change the result; None uses one per core.

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
        checked_number(outliers, "outliers", above=0, below=1)
        checked_number(noise, "noise", above=0)
        self._geometry = SilhouetteLikelihood(camera, skeleton, effective=effective, distance=distance, threads=1)
        self.skeleton = self._geometry.skeleton
        self.noise, self.outliers, self.effective, self.distance = noise, outliers, effective, distance
        self.workers = Workers(threads, "estimation")
        self.forget()

    def forget(self) -> None:
        """Reset the observation, for a new episode."""
        self.odds: np.ndarray | None = None

    @property
    def camera(self) -> Camera:
        """Camera of the current image."""
        return self._geometry.camera

    def observe(
        self, *, mask=None, rgb=None, depth=None, background=None, unseen=None, camera: Camera | None = None
    ) -> None:
        """Set the current image: one of `mask`, `rgb` and `depth`.

        Args:
            mask: (height, width), bool, integers (0 is background), or foreground probabilities as floats.
            rgb: uint8 (height, width, 3).
            depth: (height, width) [m]; infinite, or 0, where there is no body. Only its outline is used.
            background: (height, width, 3), `rgb` without the body; its edges are then ignored.
            unseen: bool (height, width), True at occluders; edges there and at their outline are ignored. None is
                nowhere.
            camera: current camera, if it moves.

        Raises:
            MotionError: not exactly one of the three, or a wrong shape or value.
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
                    raise MotionError(f"{name} must have the camera's size {(*size, 3)}, got {shape}")
            nothing = None if unseen is None else checked_unseen(unseen, size)
            self._geometry.look(camera)
            step = _TO_STEP * steepness(colours if background is None else colours - np.asarray(background, np.float32))
            edges = step > max(_COLOUR, _ABOVE * float(np.median(step)))
        self.odds = self._log_odds(edges, nothing)

    @property
    def temper(self) -> float:
        """Factor on sums over outline pixels, at most 1."""
        if self.effective is None:
            return 1.0
        return min(1.0, self.effective / (_OUTLINE * self.skeleton.height * self._scale))

    def log_likelihood(self, poses) -> np.ndarray:
        """Log-likelihood (N,) of the current edges given each of `poses` (N, 25) [m, rad], up to a constant.

        Raises:
            MotionError: no observation yet, poses of another shape, or non-finite values.
        """
        if self.odds is None:
            raise MotionError(NOTHING_OBSERVED)
        nothing = np.zeros_like(self.odds)
        return self.temper * outline_sums(self, nothing, self.odds, poses, self.workers)[1]

    @property
    def view(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """R, t, K and its inverse for `body_sums`, with the image rotated so that K is upper triangular."""
        return self._geometry.view

    @property
    def _scale(self) -> float:
        """Pixels per metre at the body."""
        return self._geometry.scale

    def _log_odds(self, edges: np.ndarray, unseen: np.ndarray | None) -> np.ndarray:
        """Log-odds of outline at each pixel, given edge pixels and occluded pixels (height, width)."""
        from scipy import ndimage

        if unseen is not None:
            # Smoothing spreads the occluder's own edge over some pixels.
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
    model: EdgeLikelihood, inside: np.ndarray, along: np.ndarray, poses, workers: Workers
) -> tuple[np.ndarray, np.ndarray]:
    """Sums over silhouettes (N,) and along outlines (N,) in one pass over each body.

    Args:
        model: provides view and skeleton.
        inside: (height, width), summed over silhouettes.
        along: (height, width), summed along outlines.
        poses: (N, 25) [m, rad].
        workers: thread pool.
    """
    from motionenv.likelihoods._edge_kernel import body_sums

    poses = checked_poses(poses)
    out = np.empty((2, len(poses)))

    body = model.skeleton
    about = (body.offsets, LIMB_SHIFTS, body.height, body.radii, *model.view, inside, along)

    def work(start: int, stop: int) -> None:
        body_sums(poses[start:stop], *about, out[0, start:stop], out[1, start:stop])

    workers.share(work, len(poses))
    return out[0], out[1]


def steepness(values: np.ndarray) -> np.ndarray:
    """Gradient magnitude (height, width) of smoothed `values`, (height, width) or (height, width, channels)."""
    from scipy import ndimage

    values = np.atleast_3d(values)
    smooth = (_SMOOTH, _SMOOTH)
    squares = [
        ndimage.gaussian_filter(values[..., i], smooth, order=order, mode="nearest") ** 2
        for i in range(values.shape[2])
        for order in ((0, 1), (1, 0))
    ]
    return np.sqrt(np.sum(squares, axis=0))
