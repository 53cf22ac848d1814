"""`dance-eval`'s options, tables, sweeps and verdicts."""

from cli.evaluating.arguments import Arguments
from cli.evaluating.on_the_beat import on_the_beat
from cli.evaluating.several import evaluate_each, evaluate_in
from cli.evaluating.sweep import run_sweep
from cli.evaluating.tables import rows_of, side_by_side
from cli.evaluating.verdict import outcome_line, verdict_of

__all__ = [
    "Arguments",
    "evaluate_each",
    "evaluate_in",
    "on_the_beat",
    "outcome_line",
    "rows_of",
    "run_sweep",
    "side_by_side",
    "verdict_of",
]
