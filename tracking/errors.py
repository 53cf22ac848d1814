"""What the tracking floor refuses."""

from robot_models import DanceError


class TrackingError(DanceError):
    """A reference, checkpoint or state that cannot be trained on."""


def shortened(value: object) -> str:
    """A value as a message can hold it."""
    text = str(value) or "nothing"
    return text if len(text) < 60 else f"{text[:57]}..."
