"""Motion → cycles (Ormoneit et al. 2005, section 3 and appendix A).

`estimate_period` finds the cycle length of a sequence, `align` brings sequences into step, `to_reference` samples
their cycles on one grid; `segment` does the three in a row. Missing samples (NaN) take no part, and gaps that no data
determine stay gaps.
"""

from motionenv.cycles.offsets import Alignment, align
from motionenv.cycles.period import Period, estimate_period
from motionenv.cycles.reference import segment, to_reference
from motionenv.cycles.snr import SNR, snr
from motionenv.cycles.splines import periodic_basis, spline_basis

__all__ = [
    "SNR",
    "Alignment",
    "Period",
    "align",
    "estimate_period",
    "periodic_basis",
    "segment",
    "snr",
    "spline_basis",
    "to_reference",
]
