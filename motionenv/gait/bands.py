"""Reference bands: mean and standard deviation over people of joint angles in percent of the gait cycle."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
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

#: The angles of the Gait Profile Score (Baker et al. 2009).
PROFILE_ANGLES = (
    "pelvis_tilt", "pelvis_obliquity", "pelvis_rotation", "hip_flexion", "hip_adduction", "hip_rotation",
    "knee_flexion", "ankle_dorsiflexion", "foot_progression",
)  # fmt: skip


@dataclass(frozen=True, eq=False, repr=False)
class Band(OneLine):
    """Joint angles of people, of whom there are `people` and `who` tells in a sentence, over the gait cycle.

    `mean` and `sd`, over people, are by angle, such as "knee_flexion", (101,) [degrees]. `scores` are by side and
    angle, such as "left_knee_flexion", the root mean square difference of each person from the mean of the others
    (people,) [degrees], NaN where unknown; none if the file of the band doesn't hold them.
    """

    mean: dict[str, np.ndarray]
    sd: dict[str, np.ndarray]
    people: int
    who: str
    scores: dict[str, np.ndarray] = field(default_factory=dict)

    def of(self, angle: str) -> np.ndarray | None:
        """Mean and standard deviation (2, 101) of one `angle`; None if the group doesn't have it."""
        return np.stack([self.mean[angle], self.sd[angle]]) if angle in self.mean else None

    def save(self, path: str | Path) -> None:
        """Write the band as JSON to the file `path`, atomically."""
        scores = {k: [round(x, 2) if np.isfinite(x) else None for x in v.tolist()] for k, v in self.scores.items()}
        content = {
            "format": _FORMAT, "people": self.people, "who": self.who,
            "mean": {k: np.round(v, 2).tolist() for k, v in self.mean.items()},
            "sd": {k: np.round(v, 2).tolist() for k, v in self.sd.items()},
            "scores": scores,
        }  # fmt: skip
        with atomic_write(path) as temporary:
            Path(temporary).write_text(json.dumps(content), encoding="utf-8")


def band_of(groups: Mapping[str, Sequence[Trial]], who: str) -> Band:
    """The mean over people of each one's mean over his strides, both sides pooled; `groups` holds each person's trials.

    `who` they are goes into the band. A `MotionError` if fewer than three people have strides.
    """
    each = [
        {side: np.concatenate([t.curves(side) for t in trials]) for side in ("left", "right")}
        for trials in groups.values()
        if any(len(t.both_sides()) for t in trials)
    ]
    if len(each) < _FEWEST:
        raise MotionError(f"a band needs at least {_FEWEST} people with strides, got {len(each)}")
    means = np.stack([mean_and_sd(np.concatenate([*curves.values()]))[0] for curves in each])
    mean, sd = mean_and_sd(means)
    known = {name: i for i, name in enumerate(ANGLES) if np.isfinite(sd[:, i]).all()}
    scores = {
        f"{side}_{name}": np.full(len(each), np.nan)
        for side in ("left", "right") for name in PROFILE_ANGLES if name in known
    }  # fmt: skip
    for person, curves in enumerate(each):
        others = mean_and_sd(np.delete(means, person, axis=0))[0]
        for key, values in differences(curves, {name: others[:, i] for name, i in known.items()}).items():
            scores[key][person] = values.mean()
    by_name = lambda values: {name: values[:, i] for name, i in known.items()}
    return Band(by_name(mean), by_name(sd), len(each), who, scores)


def differences(curves: Mapping[str, np.ndarray], mean: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """By side and angle of `PROFILE_ANGLES`, the root mean square difference of each stride from a reference [degrees].

    Args:
        curves: by side, the angles of strides, (strides, 101, 13) [degrees], in the order of `ANGLES`.
        mean: of the reference by angle, (101,) [degrees]; angles that it lacks aren't compared.

    Returns:
        (strides,) under names such as "left_knee_flexion", without strides in which the angle is partly unknown, and
        without angles of which no stride is left.
    """
    found = {}
    for side, of_side in curves.items():
        for name in PROFILE_ANGLES:
            away = np.sqrt(np.mean((of_side[:, :, ANGLES.index(name)] - mean.get(name, np.nan)) ** 2, axis=1))
            away = away[np.isfinite(away)]
            if len(away):
                found[f"{side}_{name}"] = away
    return found


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
    people = int(content["people"])
    scores = {k: np.array(v, dtype=np.float64) for k, v in content.get("scores", {}).items()}
    if any(values.shape != (people,) for values in scores.values()):
        raise ValueError
    return Band(mean, sd, people, str(content["who"]), scores)
