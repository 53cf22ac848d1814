"""What was measured on a reference: numbers with units, gates that hold or not, and the moments that decide."""

from retarget.report.feet import contact_labels
from retarget.report.measure import measure
from retarget.report.metric import Metric, Report

__all__ = ["Metric", "Report", "contact_labels", "measure"]
