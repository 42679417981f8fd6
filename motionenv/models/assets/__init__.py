"""The fitted models shipped with motionenv."""

from pathlib import Path

from motionenv.models.registry import ModelFile

__all__ = ["EIGENWALKERS", "FPCA", "PRIOR"]

_HERE = Path(__file__).parent
FPCA = ModelFile(_HERE / "walk-fpca.npz")
EIGENWALKERS = ModelFile(_HERE / "walk-eigenwalkers.npz")
PRIOR = ModelFile(_HERE / "walk-prior.npz")
