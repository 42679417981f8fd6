"""Reference bands: mean and standard deviation over people of joint angles in percent of the gait cycle."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from pathlib import Path

import numpy as np

from motionenv._core.files import atomic_write
from motionenv._core.representation import OneLine
from motionenv.errors import FormatError, MotionError
from motionenv.gait.strides import SAMPLES, mean_and_sd
from motionenv.gait.trial import ANGLES, Trial

_FORMAT = "motionenv gait band"
_FEWEST = 3  # people


@dataclass(frozen=True, eq=False, repr=False)
class Band(OneLine):
    """Joint angles of people, of whom there are `people` and `who` tells in a sentence, over the gait cycle.

    `mean` and `sd`, over people, are by angle, such as "knee_flexion", (101,) [degrees].
    """

    mean: dict[str, np.ndarray]
    sd: dict[str, np.ndarray]
    people: int
    who: str

    def of(self, angle: str) -> np.ndarray | None:
        """Mean and standard deviation (2, 101) of one `angle`; None if the group doesn't have it."""
        return np.stack([self.mean[angle], self.sd[angle]]) if angle in self.mean else None

    def save(self, path: str | Path) -> None:
        """Write the band as JSON to the file `path`, atomically."""
        content = {
            "format": _FORMAT, "people": self.people, "who": self.who,
            "mean": {k: np.round(v, 2).tolist() for k, v in self.mean.items()},
            "sd": {k: np.round(v, 2).tolist() for k, v in self.sd.items()},
        }  # fmt: skip
        with atomic_write(path) as temporary:
            Path(temporary).write_text(json.dumps(content), encoding="utf-8")


def band_of(groups: Mapping[str, Sequence[Trial]], who: str) -> Band:
    """The mean over people of each one's mean over his strides, both sides pooled; `groups` holds each person's trials.

    `who` they are goes into the band. A `MotionError` if fewer than three people have strides.
    """
    each = [np.concatenate([t.both_sides() for t in trials]) for trials in groups.values()]
    means = [mean_and_sd(curves)[0] for curves in each if len(curves)]
    if len(means) < _FEWEST:
        raise MotionError(f"a band needs at least {_FEWEST} people with strides, got {len(means)}")
    mean, sd = mean_and_sd(np.stack(means))
    known = [i for i in range(len(ANGLES)) if np.isfinite(sd[:, i]).all()]
    return Band({ANGLES[i]: mean[:, i] for i in known}, {ANGLES[i]: sd[:, i] for i in known}, len(means), who)


def load_band(path: str | Path) -> Band:
    """The band in the file `path` of `Band.save`; a `FormatError` if it isn't such a file."""
    try:
        return _parsed(json.loads(Path(path).read_text(encoding="utf-8")))
    except OSError as error:
        raise FormatError(path, f"can't be read: {error.strerror}") from None
    except (ValueError, KeyError, TypeError, AttributeError):
        raise FormatError(
            path, "isn't a band; `motionenv report FILE --group FOLDER --save-group` writes one"
        ) from None


@cache
def shipped_band() -> Band:
    """The band of the people whose walks the shipped models learned."""
    text = files("motionenv.gait").joinpath("cmu_band.json").read_text(encoding="utf-8")
    return _parsed(json.loads(text))


def _parsed(content: dict) -> Band:
    if content["format"] != _FORMAT:
        raise ValueError
    mean, sd = ({k: np.array(v, dtype=np.float64) for k, v in content[name].items()} for name in ("mean", "sd"))
    if mean.keys() != sd.keys() or not mean.keys() <= set(ANGLES):
        raise ValueError
    if any(curve.shape != (SAMPLES,) for curve in (*mean.values(), *sd.values())):
        raise ValueError
    return Band(mean, sd, int(content["people"]), str(content["who"]))
