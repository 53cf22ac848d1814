"""From a clip to a reference, stage by stage."""

from __future__ import annotations

import html
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import cache, cached_property
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips import (
    Clip,
    HumanClip,
    OutputError,
    Reference,
    RobotClip,
    make_reference,
    read_clip,
    repair,
    save_reference,
)
from clips.edit import recentre, resample
from retarget.config import RetargetConfig
from retarget.dynamics import Dynamics, dynamics_of, gliding_edges
from retarget.errors import RetargetError
from retarget.per_frame import follow, frame_solver, hand_goals, hold_hands, wrists
from retarget.recordings import plot_report, save_film, save_retargeting, save_still, show
from retarget.report import Diagnosis, Report, diagnose, measure
from retarget.solver import coarse_poses, make_objective, make_possible, optimise
from retarget.targets import (
    ContactEdit,
    Contacts,
    KeyFrame,
    MotionWithLeads,
    Targets,
    add_leads,
    apply_edits,
    as_figure,
    find_contacts,
    make_targets,
    of_this_robot,
    pin_angles,
    posture_of,
    raise_jumps,
)
from robot_models import RobotError, RobotModel, load_robot
from robot_models.maths import Progress, one_blas_thread, silent


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Retargeted:
    """A reference, what was measured on it, and the stages that led to it (for the recording)."""

    robot: RobotModel
    reference: Reference
    report: Report
    sources: tuple[HumanClip, ...]  # at the reference's frame rate; one for each dance of the reference
    contacts: Contacts
    targets: Targets | None  # None where nothing was solved
    dynamics: Dynamics | None  # None where it was not asked for or Pinocchio is not installed

    @property
    def source(self) -> HumanClip:
        """What was recorded; of several dances the first."""
        return self.sources[0]

    def __repr__(self) -> str:
        files = " + ".join(dict.fromkeys(source.source.file for source in self.sources))
        return f"Retargeted({files} on {self.robot.name}, {self.reference.duration_s:.1f} s, {self.report!r})"

    def _repr_html_(self) -> str:
        """For notebooks: what became of it, why gates are missed, every number."""
        why = "".join(f"<li>{html.escape(str(diagnosis))}</li>" for diagnosis in self.diagnoses)
        return f"<b>{html.escape(repr(self))}</b><ul>{why}</ul>{self.report._repr_html_()}"

    def show(self) -> None:
        """Open it in Rerun's viewer, in a window of its own."""
        show(self.save)

    def plot(self) -> Any:
        """The report's curves over time, missed gates shaded: a matplotlib figure.

        Raises:
            OutputError: matplotlib is not installed.
        """
        return plot_report(self.report, self.reference.fps)

    def save(self, path: Path | str, *, progress: Progress = silent) -> Path:
        """Write it: a reference (.npz), a Rerun recording (.rrd), a picture (.png) or a film (.mp4), as the name ends.

        Raises:
            OutputError: another ending, or a file that cannot be written.
        """
        path = Path(path)
        if path.suffix == ".npz":
            save_reference(self.reference, path)
        elif path.suffix == ".rrd":
            save_retargeting(
                path, self.robot, self.reference, self.report, self.diagnoses, self.sources, self.targets, self.dynamics
            )
        elif path.suffix == ".png":
            save_still(path, self.robot, self.reference, self.source)
        elif path.suffix == ".mp4":
            save_film(path, self.robot, self.reference, self.sources, progress=progress)
        else:
            raise OutputError(str(path), found="that name", expected="a name that ends in .npz, .rrd, .png or .mp4")
        return path

    @cached_property
    def diagnoses(self) -> tuple[Diagnosis, ...]:
        """Why the gates do not hold that do not."""
        return diagnose(self.report, self.reference, self.sources)


@one_blas_thread()
def retarget(
    clip: Clip | Path | str,
    robot: RobotModel | str,
    config: RetargetConfig | None = None,
    *,
    contacts: Sequence[ContactEdit] = (),
    keys: Sequence[KeyFrame] = (),
    progress: Progress = silent,
) -> Retargeted:
    """Bring a recorded motion to a robot.

    Args:
        clip: a person's or a robot's motion, or a file that says everything about itself.
        robot: who shall perform it, or its name.
        config: the numbers of every stage.
        contacts: touches that the user states; the rest is detected.
        keys: joint angles at some times of the dance (whole-clip solver only).
        progress: told as the solver goes on.

    Raises:
        DanceError: the clip cannot be used; a poor result is no error but stands in the report.
    """
    config = config or RetargetConfig()
    clip = read_clip(clip) if isinstance(clip, Path | str) else clip
    robot = load_robot(robot) if isinstance(robot, str) else robot
    if keys and config.solver != "whole-clip":
        raise RetargetError(
            f"key frames with solver {config.solver}", found=f"{len(keys)} key frames",
            expected="the whole-clip solver: a stream cannot prepare for what comes", option="solver", suggestion="whole-clip",
        )  # fmt: skip
    part = prepare(clip, robot, config, contacts, keys)
    padded = add_leads(robot, part.coarse, part.targets, config)
    qpos, padded = solve(robot, padded, part.posture, part.pins, config, progress, part.hands)
    bare = reference_of(robot, qpos, padded, config)
    dynamics = physics_of(bare, robot) if config.dynamics else None
    report = measure(bare, robot, part.source, config.gates, dynamics)
    return Retargeted(
        robot=robot,
        reference=finish_reference(bare, meta_of([part.source], config, report), dynamics),
        report=report,
        sources=(part.source,),
        contacts=part.contacts,
        targets=part.targets,
        dynamics=dynamics,
    )


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Prepared:
    """A clip on its way to a robot: what the solver needs, before leads. T frames of the dance."""

    source: HumanClip
    contacts: Contacts
    targets: Targets
    posture: Float[ndarray, "T nq"]  # to start from and to stay near
    pins: Float[ndarray, "T J"]  # key frames, NaN elsewhere
    coarse: Float[ndarray, "T nq"]  # poses on a coarse grid
    hands: Mapping[str, Float[ndarray, "T 4"]] = field(default_factory=dict)  # wanted turns, where there are any


def prepare(
    clip: Clip,
    robot: RobotModel,
    config: RetargetConfig,
    contacts: Sequence[ContactEdit] = (),
    keys: Sequence[KeyFrame] = (),
) -> Prepared:
    """Resample, find the touches, lay the source out in the robot's proportions, and guess poses."""
    recorded = recentre(resample(repair(clip), config.fps))
    source = as_figure(recorded) if isinstance(recorded, RobotClip) else recorded
    labelled = apply_edits(find_contacts(source, config.contact), contacts, config.fps)
    targets = raise_jumps(make_targets(source, labelled, robot, config), source, config.jumps)
    posture = posture_of(recorded, robot, targets)
    objective = make_objective(robot, targets, config.weights, posture[:, 7:], feet_config=config.feet)
    coarse = coarse_poses(robot, objective, posture, config.fps, config.whole_clip)
    hands = hand_goals(source, robot) if config.hands and not of_this_robot(recorded, robot) else {}
    if hands:
        coarse = hold_hands(robot, coarse, hands, config.fps)
        turned = [7 + joint for joints in wrists(robot).values() for joint in joints]
        posture[:, turned] = coarse[:, turned]
    return Prepared(
        source=source,
        contacts=labelled,
        targets=targets,
        posture=posture,
        pins=pin_angles(keys, robot, source.frames, config.fps),
        coarse=coarse,
        hands=hands,
    )


def physics_of(reference: Reference, robot: RobotModel) -> Dynamics | None:
    """The reference's rigid-body dynamics; None where Pinocchio is not installed."""
    try:
        return dynamics_of(reference, robot)
    except RobotError:  # no Pinocchio on this system: the rest of the report stands without it
        return None


def solve(
    robot: RobotModel,
    padded: MotionWithLeads,
    posture: Float[ndarray, "T nq"],
    pins: Float[ndarray, "T J"],
    config: RetargetConfig,
    progress: Progress,
    hands: Mapping[str, Float[ndarray, "T 4"]],
) -> tuple[Float[ndarray, "P nq"], MotionWithLeads]:
    """The motion, leads included, by the solver that the configuration names; and its goals, with the edges that glide."""
    near = padded.qpos[:, 7:].copy()
    near[padded.dance] = posture[:, 7:]
    if config.solver != "whole-clip":
        solver = frame_solver(config.solver, robot, config.ik, config.fps)
        return follow(solver, padded.targets, near, progress=progress), padded
    pinned_near = np.full_like(near, np.nan)
    pinned_near[padded.dance] = pins
    turned = [joint for side in hands for joint in wrists(robot)[side]]
    objective = make_objective(robot, padded.targets, config.weights, near, pinned_near, config.feet, turned)
    qpos = optimise(robot, objective, padded.qpos, config.fps, config.whole_clip, progress=progress)
    if not config.whole_clip.physics.weight:
        return qpos, padded
    if hands:  # the forearms are where they will be, nearly
        near[padded.dance, turned] = hold_hands(robot, qpos[padded.dance], hands, config.fps)[:, 7:][:, turned]
    targets = padded.targets
    glides = gliding_edges(robot, qpos, targets.feet.contact, targets.airborne, config.fps, config.glides)
    parts = targets.parts.anchored(robot, qpos, config.fps, config.feet)
    carried = replace(padded, targets=replace(targets.gliding(glides), parts=parts))
    objective = make_objective(robot, carried.targets, config.weights, near, pinned_near, config.feet, turned)
    return make_possible(robot, objective, qpos, config.fps, config.whole_clip, progress=progress), carried


def reference_of(
    robot: RobotModel, qpos: Float[ndarray, "T nq"], padded: MotionWithLeads, config: RetargetConfig
) -> Reference:
    """The solved motion with its labels and segments."""
    return make_reference(
        robot,
        qpos,
        config.fps,
        contact=padded.targets.feet.contact,
        part_contact=padded.targets.parts.kind,
        segments=padded.segments,
        meta={"segment_names": list(padded.names)},
    )


def finish_reference(bare: Reference, meta: Mapping[str, Any], dynamics: Dynamics | None) -> Reference:
    """The reference with what was found out about it: where it comes from, its report, the torques that it needs."""
    torque = None if dynamics is None else dynamics.joint_torque
    return replace(bare, meta={**bare.meta, **meta}, joint_torque=torque)


def meta_of(sources: Sequence[HumanClip], config: RetargetConfig, report: Report) -> dict[str, Any]:
    """Everything a later reader may ask of the file; nothing that changes from run to run."""
    origins = [
        {
            "file": source.source.file,
            "sha256": source.source.sha256,
            "dialect": source.source.dialect,
            "findings": [asdict(f) for f in source.source.findings],
            "conversions": list(source.source.conversions),
            "repairs": [asdict(r) for r in source.source.repairs],
        }
        for source in sources
    ]
    return {
        "source": origins[0],
        **({"more_sources": origins[1:]} if len(origins) > 1 else {}),
        "config": asdict(config),
        "versions": dict(_versions()),
        "report": report.as_dict(),
    }


@cache
def _versions() -> dict[str, str]:
    return {p: version(p) for p in ("numpy", "scipy", "mujoco")}
