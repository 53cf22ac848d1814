"""`dance-eval`'s options, tables and sweeps."""

from cli.evaluating.arguments import Arguments
from cli.evaluating.sweep import run_sweep
from cli.evaluating.tables import brief, grid, rows_of, side_by_side

__all__ = ["Arguments", "brief", "grid", "rows_of", "run_sweep", "side_by_side"]
