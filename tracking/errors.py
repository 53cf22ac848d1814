"""What the tracking floor refuses."""

from robot_models import DanceError


class TrackingError(DanceError):
    """A reference, checkpoint or state that cannot be trained on."""
