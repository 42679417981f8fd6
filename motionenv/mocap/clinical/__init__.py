"""Clinical gait analysis of captures: the Conventional Gait Model's joint centres, segments and joint angles."""

from motionenv.mocap.clinical.angles import CLINICAL_ANGLES, ClinicalAngles, clinical_angles, person_of
from motionenv.mocap.clinical.lower_body import Calibration, Leg, LowerBody, calibrate, lower_body
from motionenv.mocap.clinical.measurements import Measurements, Side, measurements_of

__all__ = [
    "CLINICAL_ANGLES", "Calibration", "ClinicalAngles", "Leg", "LowerBody", "Measurements", "Side", "calibrate",
    "clinical_angles", "lower_body", "measurements_of", "person_of",
]  # fmt: skip
