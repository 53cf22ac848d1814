"""`dance-train`'s options and summaries."""

from cli.training.arguments import Arguments
from cli.training.summary import print_check, print_plan, print_run, print_tracker

__all__ = ["Arguments", "print_check", "print_plan", "print_run", "print_tracker"]
