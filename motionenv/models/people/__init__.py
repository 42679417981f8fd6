"""People who walk: their bodies, comfortable speeds and walk ratios, and what another speed does to their gait."""

from motionenv.models.people.pace import REACH, Pace
from motionenv.models.people.population import Person, draw_person

__all__ = ["REACH", "Pace", "Person", "draw_person"]
