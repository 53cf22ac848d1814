"""What the clips floor refuses."""

from typing import Any

from robot_models import DanceError


class ClipError(DanceError):
    """A motion file that cannot be read rightly."""


class SeveralClipsError(ClipError):
    """A file that holds several clips or people, of which nobody asked for one.

    Attributes:
        names: of all of them, in order.
    """

    def __init__(self, where: str, names: tuple[str, ...], **said: Any) -> None:
        self.names = names
        super().__init__(where, **said)


class ReferenceFileError(DanceError):
    """A reference file that does not hold what it says."""
