"""What one network shall learn to dance: a reference, or several of one robot at one rate."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from clips import MetricKey, Reference, check_reference_against, load_reference
from robot_models import DanceError, RobotError, RobotModel, load_robot
from tracking.config import CheckConfig
from tracking.errors import TrackingError


@dataclass(frozen=True, kw_only=True, eq=False)
class NamedReference:
    """One dance of a repertoire."""

    name: str  # unlike the others'
    reference: Reference
    path: Path  # its file, which goes into the bundle
    sha256: str  # of the file when it was read

    @cached_property
    def weight(self) -> float:
        """How often episodes begin in it, per second of its length: half as often where physics forbids much of it."""
        measured = self.reference.report.get(MetricKey.IMPOSSIBLE_FRAMES)  # not without Pinocchio
        return 0.5 if measured is not None and measured["value"] > CheckConfig.hard_share else 1.0


def read_named_reference(path: Path | str) -> NamedReference:
    """A reference from a file, named after it.

    Raises:
        ReferenceFileError: the file is no reference.
    """
    path = Path(path)
    sha256 = (
        hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else ""
    )  # load_reference refuses what is none
    return NamedReference(name=path.stem, reference=load_reference(path), path=path, sha256=sha256)


def is_floor_work(reference: Reference, robot: RobotModel) -> bool:
    """Whether a dance brings more than feet to the floor: by its labels, or, where a file has none, by its pelvis.

    Not by how low bodies are: a G1's ankles are 27 mm over the floor on which it stands.
    """
    root_quat = np.asarray(reference.body_quat_w[:, 0], dtype=float)
    return reference.part_contact is not None or not robot.on_its_feet(reference.body_pos_w[:, 0], root_quat).all()


def check_motion_set(pieces: Sequence[NamedReference], robot: RobotModel) -> None:
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


def read_motion_set(paths: Sequence[Path], robot: RobotModel) -> list[NamedReference]:
    """References of one robot from files; raises as the two above."""
    pieces = [read_named_reference(p) for p in paths]
    check_motion_set(pieces, robot)
    return pieces


def motion_set_sha256(pieces: Sequence[NamedReference]) -> str:
    """One hash for all; a single piece's own."""
    if len(pieces) == 1:
        return pieces[0].sha256
    return hashlib.sha256("".join(p.sha256 for p in pieces).encode()).hexdigest()


def bundle_folder(folder: Path, piece: NamedReference, pieces: Sequence[NamedReference]) -> Path:
    """Where a run keeps a piece's bundle: the run's folder itself, or one inside it where there are several."""
    return folder if len(pieces) == 1 else folder / piece.name


@dataclass(frozen=True, kw_only=True, eq=False)
class Selection:
    """What a policy shall learn: references of one robot, and what was left out of a folder, with why."""

    robot: RobotModel
    pieces: tuple[NamedReference, ...]
    left_out: tuple[tuple[Path, str], ...]


def select_references(paths: Sequence[Path], robot: str | None = None, *, below_gates: bool = False) -> Selection:
    """References of one robot from files, and from all files of folders.

    Args:
        paths: references, or folders of them. What is named itself has to fit; what a folder has besides is left out.
        robot: name or profile of the robot, where the references are not all of one.
        below_gates: take references too whose gates failed.

    Raises:
        DanceError: a named file is no reference or below a gate; no reference is left; references of several robots.
    """
    files = [f for path in paths for f in (sorted(path.glob("[!.]*.npz")) if path.is_dir() else [path])]
    pieces = {file: _read_if_reference(file, named=file in paths) for file in files}
    model = _load(
        robot or _one_robot(paths, [p for p in pieces.values() if p is not None]), paths, stated=robot is not None
    )
    kept, left_out = [], []
    for file, piece in pieces.items():
        why = _why_not(piece, model, named=file in paths, below_gates=below_gates)
        if piece is None or why:
            left_out.append((file, why))
        else:
            kept.append(piece)
    if not kept:
        raise TrackingError(
            str(paths[0]), found=f"no reference of {model.name} inside its gates", expected="one at least",
            option="anyway", suggestion=" ",
        )  # fmt: skip
    check_motion_set(kept, model)
    return Selection(robot=model, pieces=tuple(kept), left_out=tuple(left_out))


def _load(robot: str, paths: Sequence[Path], *, stated: bool) -> RobotModel:
    """The references' robot; where it is nobody's and was not stated, the way to state it."""
    try:
        return load_robot(robot)
    except RobotError as e:
        if stated:
            raise
        raise TrackingError(
            str(paths[0]), found=f"a reference of '{robot}', which is no built-in robot", expected="its profile (.toml)",
            cure="say where it lies", option="robot", suggestion=f"{robot}.toml",
        ) from e  # fmt: skip


def _one_robot(paths: Sequence[Path], pieces: Sequence[NamedReference]) -> str:
    robots = sorted({piece.reference.robot for piece in pieces})
    if not robots:
        raise TrackingError(
            " ".join(map(str, paths)), found="no reference", expected="references (.npz) of this project"
        )
    if len(robots) > 1:
        raise TrackingError(
            str(paths[0]), found=f"references of {', '.join(robots)}", expected="one robot's", cure="name it",
            option="robot", suggestion=robots[0],
        )  # fmt: skip
    return robots[0]


def _read_if_reference(file: Path, *, named: bool) -> NamedReference | None:
    """A reference; None for a file that is none, which is refused where it was named."""
    try:
        return read_named_reference(file)
    except DanceError:
        if named:
            raise
        return None


def _why_not(piece: NamedReference | None, robot: RobotModel, *, named: bool, below_gates: bool) -> str:
    """Why a folder's file is left out, "" where it is not."""
    if piece is None:
        return f"no reference, not {robot.name}"
    if piece.reference.robot != robot.name and not named:
        return f"{piece.reference.robot}, not {robot.name}"
    missed = ", ".join(piece.reference.failed_gates)
    if not missed or below_gates:
        return ""
    if named:
        raise TrackingError(
            str(piece.path), found=f"gates that failed: {missed}", expected="a reference inside its gates",
            cure="retarget it again: it says why, and what to leave out", option="anyway", suggestion=" ",
        )  # fmt: skip
    return f"gates that failed: {missed}"
