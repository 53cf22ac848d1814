"""`dance-deploy`'s options and checks."""

from cli.deploying.arguments import Arguments, check
from cli.deploying.checks import checked

__all__ = ["Arguments", "check", "checked"]
