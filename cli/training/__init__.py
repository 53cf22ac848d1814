"""`dance-train`'s options and verdicts."""

from cli.training.arguments import Arguments
from cli.training.beginning import as_begun, keep_beginning, teacher_of
from cli.training.summary import check_table, check_verdict, print_plan, print_tracker, run_details, run_verdict, slower

__all__ = [
    "Arguments",
    "as_begun",
    "check_table",
    "check_verdict",
    "keep_beginning",
    "print_plan",
    "print_tracker",
    "run_details",
    "run_verdict",
    "slower",
    "teacher_of",
]
