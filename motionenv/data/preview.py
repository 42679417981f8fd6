"""Contact sheet of a data set, before anything is made."""

import math

import numpy as np

from motionenv._core.validation import checked_whole
from motionenv.data.samples import Sample, Sampler
from motionenv.data.specification import Specification
from motionenv.render.draw2d.overlay import draw_pose
from motionenv.types import Camera

_TILE = 240  # pixels, least width of a picture in the sheet
_GREY = 60


def contact_sheet(spec: Specification, samples: int = 16) -> np.ndarray:
    """A picture (height, width, 3) uint8 of the first `samples` (1 to 256) of `spec`, each with its joints.

    Of a clip it shows the frame in the middle, and below it the first and the last one.
    """
    count = min(checked_whole(samples, "samples", 1, 256), spec.samples)
    pictures = () if spec.pictures.background == "black" and "rgb" not in spec.output.fields else ("rgb",)
    shown = spec.replace(output={"fields": (*(pictures or ("mask",)), "joints", "camera")})
    tiles = [_tile(sample, shown) for sample in Sampler(shown).samples(0, count)]
    columns = math.ceil(math.sqrt(count * tiles[0].shape[0] / tiles[0].shape[1]))
    rows = -(-count // columns)
    tiles += [np.full_like(tiles[0], _GREY)] * (rows * columns - count)
    return np.concatenate([np.concatenate(tiles[r * columns : (r + 1) * columns], axis=1) for r in range(rows)])


def _tile(sample: Sample, spec: Specification) -> np.ndarray:
    """The frame in the middle of a sample, with its stick figure; of a clip also the first and the last, smaller."""
    if spec.clip == 1:
        return _framed(_drawn(sample, spec, sample))
    frames = [0, spec.clip // 2, spec.clip - 1]
    first, middle, last = (
        _drawn(sample, spec, {name: sample[name][k] for name in sample if name in ("rgb", "mask", "joints", "t")})
        for k in frames
    )
    below = np.concatenate([first[::2, ::2], last[::2, ::2]], axis=1)[:, : middle.shape[1]]
    return _framed(np.concatenate([middle, np.pad(below, ((0, 0), (0, middle.shape[1] - below.shape[1]), (0, 0)))]))


def _drawn(sample: Sample, spec: Specification, now: dict[str, np.ndarray]) -> np.ndarray:
    """One frame, `now`, enlarged, with its stick figure."""
    picture = now["rgb"] if "rgb" in now else np.repeat(now["mask"][..., None] // 2, 3, axis=2)
    finer = max(1, -(-_TILE // picture.shape[1]))
    picture = np.repeat(np.repeat(picture, finer, axis=0), finer, axis=1)
    K = sample["K"].copy()
    K[:2] *= finer
    K[:2, 2] += (finer - 1) / 2  # pixel centres are at integers
    camera = Camera(K, sample["R"], now["t"], picture.shape[1], picture.shape[0])
    return draw_pose(picture, now["joints"], camera, width=max(1.0, picture.shape[0] / 200))


def _framed(tile: np.ndarray) -> np.ndarray:
    return np.pad(tile, ((2, 2), (2, 2), (0, 0)), constant_values=_GREY)
