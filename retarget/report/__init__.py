"""What was measured on a reference: numbers with units, gates that hold or not, and the moments that decide."""

from retarget.report.beats import beat_metrics
from retarget.report.diagnosis import Cure, Diagnosis, diagnose
from retarget.report.feet import contact_labels
from retarget.report.limbs import limb_angles
from retarget.report.measure import measure
from retarget.report.metric import Metric, Report, Where

__all__ = [
    "Cure",
    "Diagnosis",
    "Metric",
    "Report",
    "Where",
    "beat_metrics",
    "contact_labels",
    "diagnose",
    "limb_angles",
    "measure",
]
