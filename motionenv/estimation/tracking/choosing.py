"""Which of two attempts at a film shows it better, by the figures that they expect: silhouettes, and colours of limbs.

From the side a walker and his mirror image have the same outline, but not the same near leg: it hides the far one's
shoe, and the near hand is seen before the trousers. So each kind of limb, both sides dressed alike, has colours of
its own, learned from pixels in which both attempts see that kind of limb; and a pixel of a figure says

    log-odds = log[(1 - outliers) p(colour | limb) / p(colour | body) + outliers]

of colours that the whole body has: against the background silhouettes tell already. The evidence of the filters isn't
asked. A belief that is undecided between left and right has more of it than one that errs, and as much as one that is
right, but its mean is the pose of nobody.
"""

import numpy as np

from motionenv.body import LIMBS
from motionenv.estimation.appearance import COLOURS
from motionenv.estimation.observation import ObservationModel

_EFFECTIVE = 25.0  # pixels of a figure whose colours count as independent, in each frame
_OUTLIERS = 0.2  # share of a limb's pixels that have any colour of the body
_POOL = 20.0  # pixels by which a limb's colours lean towards the body's
_KINDS = sorted({limb.removeprefix("left_").removeprefix("right_") for limb in LIMBS})
#: Kind of limb, from 1, of a limb's number in a picture; 0 is none.
_KIND = np.array([0, *(1 + _KINDS.index(limb.removeprefix("left_").removeprefix("right_")) for limb in LIMBS)])


def advantage(
    one: np.ndarray, other: np.ndarray, likelihood: ObservationModel, film: np.ndarray, colours: np.ndarray
) -> float:
    """How much better one attempt shows a film than another, in log-odds; negative where it shows it worse.

    Args:
        one: expected poses (T, 25) [m, rad].
        other: those of the other attempt (T, 25).
        likelihood: of masks.
        film: (T, height, width) probabilities of foreground.
        colours: (T, height, width) of `motionenv.estimation.appearance.colour_bins`.
    """
    from motionenv.render.raycast import Raycaster

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
    """Log-odds (cells,) of each kind of limb's colours against the whole body's, from numbers of pixels (cells,)."""
    limbs = counts.reshape(-1, COLOURS)
    body = limbs.sum(axis=0) + 1 / COLOURS
    body /= body.sum()
    limbs = (limbs + _POOL * body) / (limbs.sum(axis=1, keepdims=True) + _POOL)
    return np.log((1 - _OUTLIERS) * limbs / body + _OUTLIERS).ravel()
