"""Segmentation of motion into cycles (Ormoneit et al. 2005, section 3 and appendix A).

`estimate_period` estimates the cycle length of a sequence, `align` aligns sequences in phase, `to_reference` resamples
their cycles on a common grid; `segment` runs all three. Missing samples (NaN) are ignored, and gaps that the data don't
determine remain gaps.
"""

from motionenv.cycles.offsets import Alignment, align
from motionenv.cycles.period import Period, estimate_period
from motionenv.cycles.reference import segment, to_reference
from motionenv.cycles.registration import Registered, register
from motionenv.cycles.snr import SNR, snr
from motionenv.cycles.splines import periodic_basis, spline_basis

__all__ = [
    "SNR", "Alignment", "Period", "Registered", "align", "estimate_period", "periodic_basis", "register",
    "segment", "snr", "spline_basis", "to_reference",
]  # fmt: skip
