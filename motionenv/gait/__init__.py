"""Gait analysis of captures: events, steady stretches, strides, step parameters, and reports."""

from motionenv.gait.bands import Band, band_of, load_band, shipped_band
from motionenv.gait.comparison import Comparison, compare, read_table
from motionenv.gait.effects import Effect, effect_of
from motionenv.gait.events import Events, find_events
from motionenv.gait.feet import Feet, feet_of
from motionenv.gait.norms import Norm, norms_for
from motionenv.gait.profile import Score, profile_of
from motionenv.gait.report import write_comparison, write_report
from motionenv.gait.session import Session, read_group, read_people, read_session
from motionenv.gait.stretches import Stretch, find_stretches
from motionenv.gait.strides import Stride, find_strides, normalised, strides_by_phase
from motionenv.gait.summary import Parameter, summarise
from motionenv.gait.trial import Trial, analyse, read_trial

__all__ = [
    "Band", "Comparison", "Effect", "Events", "Feet", "Norm", "Parameter", "Score", "Session", "Stretch", "Stride",
    "Trial", "analyse", "band_of", "compare", "effect_of", "feet_of", "find_events", "find_stretches", "find_strides",
    "load_band", "normalised", "norms_for", "profile_of", "read_group", "read_people", "read_session", "read_table",
    "read_trial", "shipped_band", "strides_by_phase", "summarise", "write_comparison", "write_report",
]  # fmt: skip
