"""The environments' names in Gymnasium's registry.

Gymnasium 1 no longer looks for plugins, so somebody has to tell it of these environments: importing `motionenv` does,
before or after Gymnasium, and without loading it.
"""

import importlib.util
import sys
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec

#: Ids, and where the classes are: single and vector environment.
ENVIRONMENTS = {
    "motionenv/WalkerTracking-v0": "motionenv.envs.walker:WalkerTracking",
    "motionenv/MarkerTracking-v0": "motionenv.envs.markers:MarkerTracking",
    "motionenv/ArmTracking-v0": "motionenv.envs.arm:ArmTracking",
}


def register() -> None:
    """Tell Gymnasium of the environments; those that it knows are left alone."""
    from gymnasium.envs import registration

    for name, entry in ENVIRONMENTS.items():
        if name not in registration.registry:
            registration.register(name, entry_point=entry, vector_entry_point=f"{entry}Vector")


def register_with_gymnasium() -> None:
    """`register` now if Gymnasium is loaded, else as soon as it is."""
    if sys.modules.get("gymnasium") is not None:
        register()
    else:
        sys.meta_path.insert(0, _Watch())


class _Watch(MetaPathFinder):
    """Sees Gymnasium being imported, and registers the environments right after."""

    def find_spec(self, name: str, path: object = None, target: object = None) -> ModuleSpec | None:
        if name != "gymnasium":
            return None
        sys.meta_path.remove(self)
        spec = importlib.util.find_spec(name)
        if spec is not None and spec.loader is not None:
            load = spec.loader.exec_module

            def load_and_register(module) -> None:
                load(module)
                register()

            spec.loader.exec_module = load_and_register  # type: ignore[method-assign]
        return spec
