"""Frames by the names of their images: the number in them that counts up, or the time that they state."""

import re
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from reprlib import repr as _short

import numpy as np

from motionenv.errors import FormatError

#: Most frames of a film: an hour at 28 per second.
MOST_FRAMES = 100_000
_SPARSE = 50  # ratio of the range of numbers to the number of images above which they can't be frame numbers
_RATES = (0.5, 500.0)  # [Hz] of frames that state times; those that state more are counted
_DIGITS = re.compile(r"\d{1,30}")
_EXTENSION = re.compile(r"(\.[A-Za-z]\w{0,4})+$")
#: Times: a date, a clock and a fraction of three digits or more, as
#: 2018-07-04T12_04_17.738369 or 20180704_120417_738; seconds since 1970, 1530705857.738369, also in ms, us or ns.
_DATED = re.compile(r"(?<!\d)((?:19|20)\d\d)[-_.]?([01]\d)[-_.]?([0-3]\d)[-_. T]+"
                    r"([0-2]\d)[-_.:h]?([0-5]\d)[-_.:m]?([0-5]\d)[-_.,:s]?(\d{3,9})(?!\d)")  # fmt: skip
_EPOCH = re.compile(r"(?<!\d)(1\d{9})[._]?(\d{3,9})(?!\d)")


def frame_numbers(path: str | Path, images: Sequence[int | str]) -> tuple[list[int], float | None]:
    """The frame number of each of `images`, from 0, and the frame rate [Hz] if their names state times.

    Whole numbers are frame numbers. In names, the number that counts up is, and those that are the same in all names,
    or that occur twice, as a camera's, aren't. Missing numbers are missing frames; those of times are as many as fit.

    Raises:
        FormatError: no number counts up, or numbers are too far apart to be those of frames.
    """
    names = sorted(set(images), key=str)
    rate = None
    if all(isinstance(name, int) for name in names):
        numbers = [int(name) for name in names]
    elif (timed := _timed([str(name) for name in names])) is not None:
        numbers, rate = timed
    else:
        numbers = _counted(path, [str(name) for name in names])
    first, span = min(numbers, default=0), max(numbers, default=0) - min(numbers, default=0) + 1
    if span > max(_SPARSE * len(names), 1000) or span > MOST_FRAMES:
        problem = f"the {len(names)} frames span {_short(span)} numbers: no frame numbers, or more than {MOST_FRAMES}"
        raise FormatError(path, f"{problem}; renumber them 0, 1, 2, ..., or cut the walk out", "image_id")
    of = dict(zip(names, numbers, strict=True))
    return [of[image] - first for image in images], rate


def _counted(path, names: list[str]) -> list[int]:
    """The numbers, at the same place from the left or from the right, that differ in all names and span least."""
    groups = [[int(word) for word in _DIGITS.findall(_EXTENSION.sub("", name))] for name in names]
    if (without := [name for name, found in zip(names, groups, strict=True) if not found]) != []:
        raise FormatError(path, f"must be the number of a frame or hold one, got {_short(without[0])}", "image_id")
    shared = min(map(len, groups))
    columns = [[found[at] for found in groups] for at in range(-shared, shared)]
    counting = [column for column in columns if len(set(column)) == len(names)]
    if not counting:
        most = max(columns, key=lambda column: len(set(column)))
        problem = f"{len(names)} files or images have {len(set(most))} numbers, such as {_short(names[0])}"
        raise FormatError(path, f"{problem}: keep those of one camera, each with the number of its frame", "image_id")
    return min(counting[::-1], key=lambda column: max(column) - min(column))


def _timed(names: list[str]) -> tuple[list[int], float] | None:
    """Frame numbers and rate by the times in all names; None if these are no times of frames."""
    known = [one for one in map(_seconds, names) if one is not None]
    if len(known) < len(names) or len(known) < 2:
        return None
    whole, fraction = np.array(known).T
    seconds = whole - whole.min() + fraction
    order = np.argsort(seconds)
    steps = np.diff(seconds[order])
    usual = float(np.median(steps))
    if not (steps > 0).all() or not _RATES[0] <= 1 / usual <= _RATES[1]:
        return None
    numbers = np.concatenate([[0.0], np.maximum(np.rint(steps / usual), 1).cumsum()])
    rate = float(numbers[-1] / (seconds[order[-1]] - seconds[order[0]]))
    return [int(number) for number in numbers[np.argsort(order)]], rate


def _seconds(name: str) -> tuple[float, float] | None:
    """Whole seconds of the time in a name, and their fraction."""
    if (found := _EPOCH.search(name)) is not None:
        return float(found[1]), float(f"0.{found[2]}")
    if (found := _DATED.search(name)) is None:
        return None
    try:
        date = datetime.strptime("".join(found.groups()[:6]), "%Y%m%d%H%M%S").replace(tzinfo=UTC)
    except ValueError:
        return None
    return date.timestamp(), float(f"0.{found[7]}")
