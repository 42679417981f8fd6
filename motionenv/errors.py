"""Errors of motionenv. All are ValueErrors, and their messages say how to fix the problem."""

import re
from pathlib import Path

_NUMPY = re.compile(r"\bnp\.(?:(?:float|u?int|bool|str|longdouble)\w*\(([^()]*)\)|(True|False)_)")


class MotionError(ValueError):
    """An invalid motion, model or argument.

    Args:
        message: what is wrong and what was expected; NumPy's scalars in it are written as plain numbers.
        fields: names of the arguments that are wrong, if it is these.
    """

    def __init__(self, message: str = "", *fields: str) -> None:
        super().__init__(_NUMPY.sub(lambda scalar: scalar[1] or scalar[2] or "", message))
        self.fields = fields


class FormatError(MotionError):
    """A file can't be read.

    Args:
        path: the file.
        problem: what is wrong, and what was expected.
        where: the line or block; "" for the whole file.
    """

    def __init__(self, path: str | Path, problem: str, where: str = "") -> None:
        place = f"{path}, {where}" if where else f"{path}"
        super().__init__(f"{place}: {problem}")
        self.path, self.where, self.problem = str(path), where, problem

    def __reduce__(self):
        """Pickle by the three parts, so that the error can cross process borders."""
        return FormatError, (self.path, self.problem, self.where)


class GapError(MotionError):
    """Too many missing values (NaN) for a meaningful result."""


class ModelError(MotionError):
    """A model file of another kind or version, or a model used before `fit`."""


class EngineError(MotionError):
    """A rendering engine can't run here: the message says what to install."""


class ExtrapolationWarning(UserWarning):
    """A model was asked for what none of the walks that it learned from shows, such as a very fast walk."""


class CaptureWarning(UserWarning):
    """A capture was read otherwise than its file says, or is not plausible for a person."""


class FitWarning(UserWarning):
    """A model was fitted to data that don't suit it, or its fit didn't converge: what was found, and what to do."""
