"""What one network shall learn to dance: a reference, or several of one robot at one rate."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from clips import Reference, check_reference_against, load_reference
from robot_models import RobotModel
from tracking.errors import TrackingError

_HARD = "frames that physics does not allow"  # metric of a reference's report [%]
_TOO_HARD = 10.0  # the share from which dance-retarget says down-weight


@dataclass(frozen=True, kw_only=True, eq=False)
class Piece:
    """One dance of a repertoire."""

    name: str  # unlike the others'
    reference: Reference
    path: Path  # its file, which goes into the bundle
    sha256: str  # of the file when it was read

    @cached_property
    def weight(self) -> float:
        """How often episodes begin in it, per second of its length: half as often where physics forbids much of it."""
        told = self.reference.meta.get("report", {}).get(_HARD, {})
        return 0.5 if told.get("value", 0.0) > _TOO_HARD else 1.0


def read_piece(path: Path) -> Piece:
    """A reference from a file, named after it.

    Raises:
        ReferenceFileError: the file is no reference.
    """
    sha256 = (
        hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else ""
    )  # load_reference refuses what is none
    return Piece(name=path.stem, reference=load_reference(path), path=path, sha256=sha256)


def check_together(pieces: Sequence[Piece], robot: RobotModel) -> None:
    """Refuse what one network of this robot cannot learn.

    Raises:
        ReferenceFileError, TrackingError: another robot's reference, two of one name, or different rates.
    """
    for piece in pieces:
        check_reference_against(piece.reference, robot, f"reference {piece.name}")
        if [p.name for p in pieces].count(piece.name) > 1:
            raise TrackingError(
                f"reference {piece.name}", found="a second one of that name", expected="files of different names"
            )
        if piece.reference.fps != pieces[0].reference.fps:
            raise TrackingError(
                f"reference {piece.name}", found=f"{piece.reference.fps:g} frames/s", cure="retarget it again at that rate",
                expected=f"{pieces[0].reference.fps:g}, as {pieces[0].name}: one network acts at one rate",
            )  # fmt: skip


def read_pieces(paths: Sequence[Path], robot: RobotModel) -> list[Piece]:
    """References of one robot from files; raises as the two above."""
    pieces = [read_piece(p) for p in paths]
    check_together(pieces, robot)
    return pieces


def repertoire_sha256(pieces: Sequence[Piece]) -> str:
    """One hash for all; a single piece's own."""
    if len(pieces) == 1:
        return pieces[0].sha256
    return hashlib.sha256("".join(p.sha256 for p in pieces).encode()).hexdigest()


def bundle_folder(folder: Path, piece: Piece, pieces: Sequence[Piece]) -> Path:
    """Where a run keeps a piece's bundle: the run's folder itself, or one inside it where there are several."""
    return folder if len(pieces) == 1 else folder / piece.name
