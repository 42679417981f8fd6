"""Gait reports: a page of figures for a clinician, with the same figures as JSON and CSV beside it."""

from motionenv.gait.report.comparing import write_comparison
from motionenv.gait.report.page import page
from motionenv.gait.report.writing import to_csv, to_json, write_report

__all__ = ["page", "to_csv", "to_json", "write_comparison", "write_report"]
