"""Choose the better of two tracks of a video by silhouettes and limb colours.

From the side, a walker and the mirror image have the same outline but differ in which leg is nearer: it occludes the
other shoe, and the near hand is seen in front of the trousers. Each kind of limb (left and right dressed alike)
therefore gets a colour histogram, learned from pixels at which both tracks see that kind of limb. A pixel contributes

    log-odds = log[(1 - outliers) p(colour | limb) / p(colour | body) + outliers]

relative to the colours of the whole body, because silhouettes already account for the background. The evidence of the
filters is not used: a posterior that is undecided between left and right has higher evidence than a wrong one, and
about that of a correct one, although its mean is a meaningless pose.
"""

import numpy as np

from motionenv.body import LIMBS
from motionenv.likelihoods.appearance import COLOURS
from motionenv.likelihoods.silhouette import SilhouetteLikelihood

_EFFECTIVE = 25.0  # effective number of independent pixels of a body in each frame
_OUTLIERS = 0.2  # fraction of a limb's pixels with other body colours
_POOL = 20.0  # pseudo-count [pixels] that shrinks a limb's histogram towards the body's
_KINDS = sorted({limb.removeprefix("left_").removeprefix("right_") for limb in LIMBS})
#: Kind of limb, from 1, by limb number in a label image; 0 is none.
_KIND = np.array([0, *(1 + _KINDS.index(limb.removeprefix("left_").removeprefix("right_")) for limb in LIMBS)])


def advantage(
    one: np.ndarray, other: np.ndarray, likelihood: SilhouetteLikelihood, film: np.ndarray, colours: np.ndarray
) -> float:
    """Log-odds in favour of one track of a video over another.

    Args:
        one, other: expected poses (T, 25) [m, rad] of the two.
        likelihood: of masks.
        film: (T, height, width) foreground probabilities.
        colours: (T, height, width) of `motionenv.likelihoods.appearance.colour_bins`.
    """
    from motionenv.render.raycast.engine import Raycaster

    raycaster, cells = Raycaster(), (1 + len(_KINDS)) * COLOURS
    agreed, seen, silhouettes = np.zeros(cells), np.zeros((2, cells)), np.zeros(2)
    for poses, foreground, colour in zip(np.stack([one, other], axis=1), film, colours, strict=True):
        likelihood.observe(mask=foreground)
        silhouettes += likelihood.log_likelihood(poses)
        limbs = raycaster.render(poses, likelihood.skeleton, likelihood.camera, rgb=False).limbs
        kinds = _KIND[np.asarray(limbs)]
        body, cell = (kinds > 0) & (foreground > 0.5), kinds * COLOURS + colour
        agreed += np.bincount(cell[0][body[0] & (kinds[0] == kinds[1])], minlength=cells)
        seen += [np.bincount(cell[i][body[i]], minlength=cells) for i in range(2)]
    each = (seen * _log_odds(agreed)).sum(axis=1) / np.maximum(seen.sum(axis=1), 1.0)
    first, second = silhouettes + _EFFECTIVE * len(film) * each
    return float(first - second)


def _log_odds(counts: np.ndarray) -> np.ndarray:
    """Log-odds (cells,) of each kind of limb's colours against the whole body's, from pixel counts (cells,)."""
    limbs = counts.reshape(-1, COLOURS)
    body = limbs.sum(axis=0) + 1 / COLOURS
    body /= body.sum()
    limbs = (limbs + _POOL * body) / (limbs.sum(axis=1, keepdims=True) + _POOL)
    return np.log((1 - _OUTLIERS) * limbs / body + _OUTLIERS).ravel()
