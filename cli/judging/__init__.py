"""Robots' motions from any tool, as they stand: read, judged, compared, and given to commands that take references."""

from cli.judging.as_reference import as_references, reference_for
from cli.judging.judge import OWN_FEET, Judged, judge_all
from cli.judging.known_dances import followed, known_dances, names_of_known_dances
from cli.judging.tables import difference_table, metrics_table

__all__ = [
    "OWN_FEET",
    "Judged",
    "as_references",
    "difference_table",
    "followed",
    "judge_all",
    "known_dances",
    "metrics_table",
    "names_of_known_dances",
    "reference_for",
]
