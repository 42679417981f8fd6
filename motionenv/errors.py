"""Errors that motionenv raises on purpose. All are ValueErrors, and each says what to do next."""


class MotionError(ValueError):
    """Something about a motion, a model or a request is not as it must be."""


class FormatError(MotionError):
    """A file can't be read: the message names the file, the line or block, and what was expected."""

    def __init__(self, path, problem: str, where: str = ""):
        place = f"{path}, {where}" if where else f"{path}"
        super().__init__(f"{place}: {problem}")
        self.path, self.where, self.problem = str(path), where, problem

    def __reduce__(self):
        """Pickle by the three parts, so that the error crosses process borders whole."""
        return FormatError, (self.path, self.problem, self.where)


class GapError(MotionError):
    """Too much is missing (NaN) for the answer to mean anything."""


class ModelError(MotionError):
    """A model file is of another kind or version, or a model was used before `fit`."""


class EngineError(MotionError):
    """A rendering engine can't run here: the message says what to install."""
