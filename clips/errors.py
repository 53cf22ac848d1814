"""What the clips floor refuses."""

from robot_models import DanceError


class ClipError(DanceError):
    """A motion file that cannot be read rightly."""


class ReferenceFileError(DanceError):
    """A reference file that does not hold what it says."""
