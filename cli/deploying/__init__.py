"""`dance-deploy`'s options, checks and verdict."""

from cli.deploying.arguments import Arguments, check
from cli.deploying.checks import checked
from cli.deploying.verdict import performance_verdict

__all__ = ["Arguments", "check", "checked", "performance_verdict"]
