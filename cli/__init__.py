"""The commands: parse, call one function, report, return an exit code."""

from robot_models import __version__

__all__ = ["__version__"]
