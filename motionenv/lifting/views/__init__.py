"""Closed-form reconstruction for known and unknown views (paper B, sections 3 and 4)."""

from motionenv.lifting.views.known_view import Reconstruction, least_squares, maximum_a_posteriori
from motionenv.lifting.views.unknown_view import Views, find_view

__all__ = ["Reconstruction", "Views", "find_view", "least_squares", "maximum_a_posteriori"]
