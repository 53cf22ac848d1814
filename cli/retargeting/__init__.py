"""`dance-retarget`'s options, batches and verdicts."""

from cli.retargeting.arguments import Arguments, check_one
from cli.retargeting.batch import is_batch, retarget_all
from cli.retargeting.report_table import report_table
from cli.retargeting.steps import read_dances, save_result, solve_dances
from cli.retargeting.verdict import Danced, details_of, verdict_of

__all__ = [
    "Arguments",
    "Danced",
    "check_one",
    "details_of",
    "is_batch",
    "read_dances",
    "report_table",
    "retarget_all",
    "save_result",
    "solve_dances",
    "verdict_of",
]
