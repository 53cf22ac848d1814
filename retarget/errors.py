"""What the retargeting floor refuses."""

from robot_models import DanceError


class RetargetError(DanceError):
    """A clip that cannot be brought to a robot."""
