"""People who walk: their bodies, comfortable speeds and walk ratios, and what another speed does to their gait."""

from motionenv.models.people.pace import REACH, Pace
from motionenv.models.people.population import Person, average_person, draw_person, usual_adult

__all__ = ["REACH", "Pace", "Person", "average_person", "draw_person", "usual_adult"]
