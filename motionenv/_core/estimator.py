"""The protocol of scikit-learn's estimators, for which scikit-learn needn't be installed."""

import inspect
from typing import Any, Self

from motionenv.errors import MotionError


class Estimator:
    """Settings are the arguments of the constructor, which are attributes of the same names and checked by `fit`."""

    @classmethod
    def _settings(cls) -> list[str]:
        return list(inspect.signature(cls).parameters)

    def get_params(self, deep: bool = True) -> dict[str, Any]:
        """The settings by name, for `sklearn.base.clone` and searches; `deep` has no effect."""
        return {name: getattr(self, name) for name in self._settings()}

    def set_params(self, **settings: Any) -> Self:
        """Change `settings`, which hold from the next `fit` on.

        Raises:
            MotionError: no such setting.
        """
        for name, value in settings.items():
            if name not in self._settings():
                raise MotionError(f"{type(self).__name__} has no setting {name}: it has {', '.join(self._settings())}")
            setattr(self, name, value)
        return self

    def __sklearn_tags__(self) -> Any:
        """What scikit-learn asks of estimators: this one needs no target and takes missing samples."""
        from sklearn.utils import InputTags, Tags, TargetTags, TransformerTags

        inputs = InputTags(two_d_array=False, three_d_array=True, allow_nan=True)
        return Tags("transformer", TargetTags(required=False), TransformerTags(), input_tags=inputs)
