"""Rerun recordings of finished results, a story each; what they are made of stands in `scene`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy import ndarray

from clips import HumanClip, Reference
from retarget.dynamics import Dynamics
from retarget.recordings import scene
from retarget.recordings.blueprint import bar_view, line_view, send_blueprint
from retarget.recordings.marks import draw_contact_lanes, draw_forces, mark_diagnoses
from retarget.report import Diagnosis, Report
from retarget.targets import Targets
from robot_models import RobotModel, visual_parts


def save_retargeting(
    path: Path,
    robot: RobotModel,
    reference: Reference,
    report: Report,
    diagnoses: Sequence[Diagnosis],
    sources: Sequence[HumanClip],
    targets: Targets | None = None,
    dynamics: Dynamics | None = None,
) -> None:
    """Source, targets, robot, contacts, the report's curves and what is wrong, of one retargeting.

    Args:
        path: the recording.
        robot: the robot.
        reference: what it shall do.
        report: of the reference.
        diagnoses: of the gates that are missed.
        sources: what was recorded, one for each dance of the reference.
        targets: the solver's, of all dances; None where nothing was solved, and the robot is its own source.
        dynamics: whose forces are drawn.
    """
    files = " | ".join(dict.fromkeys(source.source.file for source in sources))
    with scene.recording(path, f"{robot.name}: {files}") as log:
        index = scene.timelines(np.arange(reference.frames), reference.fps)
        scene.lay_floor(log, reference.body_pos_w[:, 0], index, reference.fps)
        scene.draw_robot(log, "world/robot", visual_parts(robot))
        scene.move_robot(log, "world/robot", robot, reference.body_pos_w, reference.body_quat_w, index)
        scene.draw_soles(log, robot, reference, index)
        if targets is not None:
            for source, dance in zip(sources, reference.dances, strict=True):
                scene.draw_source(log, source, dance.start)
            scene.draw_targets(log, targets, reference, robot)
        if dynamics is not None:
            draw_forces(log, dynamics, index)
        scene.plot_curves(log, "plots/report", report.series, index)
        log.log("report", scene.markdown(scene.report_text(report, diagnoses, sources)), static=True)
        marks = mark_diagnoses(log, robot, reference, diagnoses)
        plots = [line_view(name, f"plots/report/{scene.slug(name)}") for name in report.series]
        send_blueprint(log, [*marks, *plots], tall=len(marks))


def save_rollouts(
    path: Path, robot: RobotModel, reference: Reference, rollouts: Mapping[str, ndarray],
    curves: Mapping[str, tuple[ndarray, ndarray]], text: str,
) -> None:  # fmt: skip
    """A policy's rollouts side by side, each beside the ghost of its reference, with the learning curves.

    Args:
        path: the recording.
        robot: the robot.
        reference: what it should do.
        rollouts: name, as of an engine -> (N, nq) what it did, from the first frame of the reference's dance on.
        curves: name -> (steps, values).
        text: markdown summary.
    """
    from robot_models import forward_kinematics

    dance, parts = reference.dance, visual_parts(robot)
    with scene.recording(path, f"{robot.name}: policy against its reference") as log:
        longest = max(map(len, rollouts.values()))
        way = reference.body_pos_w[dance.start : dance.start + longest, 0]
        scene.lay_floor(log, way, scene.timelines(np.arange(longest), reference.fps), reference.fps)
        plots, danced, meant = [], [], []
        for k, (name, rollout) in enumerate(rollouts.items()):
            frames, aside_m = len(rollout), np.array([0.0, -scene.SIDE_M * k, 0.0])
            index = scene.timelines(np.arange(frames), reference.fps)
            there = slice(dance.start, dance.start + frames)  # evaluations begin with the dance
            pos, quat = forward_kinematics(robot, rollout)
            danced.append((pos + aside_m, quat))
            meant.append((reference.body_pos_w[there] + aside_m, reference.body_quat_w[there]))
            if len(rollouts) > 1:
                scene.label(log, f"world/{scene.slug(name)}-name", name, pos[:, 0] + aside_m, index)
            error = 1e3 * np.linalg.norm(pos - reference.body_pos_w[there], axis=-1).mean(axis=1)
            what = "distance from the ghost [mm]"
            scene.plot_curves(log, f"plots/{scene.slug(name)}", {what: error}, index)
            plots.append(line_view(f"{what}: {name}", f"plots/{scene.slug(name)}/{scene.slug(what)}"))
        whole = scene.timelines(np.arange(longest), reference.fps)
        scene.draw_figures(log, "world/robots", parts, robot, danced, whole)
        scene.draw_figures(log, "world/ghosts", parts, robot, meant, whole, tint=scene.GHOST)
        scene.plot_learning(log, curves)
        log.log("report", scene.markdown(text), static=True)
        plots += [bar_view(f"{n} over million steps", f"plots/learning/{scene.slug(n)}") for n in curves]
        middle = -0.5 * scene.SIDE_M * (len(rollouts) - 1)
        away = 2.5 + 0.6 * (len(rollouts) - 1)
        send_blueprint(log, plots, eye=(away, middle - 0.7, 0.5 * away), look=(0.0, middle, 0.72))


def save_rehearsal(
    path: Path, robot: RobotModel, qpos: ndarray, fps: float, series: Mapping[str, ndarray], text: str
) -> None:
    """What a robot did, with curves by frame and a summary.

    Args:
        path: the recording.
        robot: the robot.
        qpos: (N, nq).
        fps: of qpos.
        series: name -> (N,) values.
        text: markdown summary.
    """
    from robot_models import forward_kinematics

    pos, quat = forward_kinematics(robot, qpos)
    with scene.recording(path, f"{robot.name}: rehearsal") as log:
        index = scene.timelines(np.arange(len(qpos)), fps)
        scene.lay_floor(log, pos[:, 0], index, fps)
        scene.draw_robot(log, "world/robot", visual_parts(robot))
        scene.move_robot(log, "world/robot", robot, pos, quat, index)
        scene.plot_curves(log, "plots/rehearsal", series, index)
        log.log("report", scene.markdown(text), static=True)
        send_blueprint(
            log,
            [line_view(name, f"plots/rehearsal/{scene.slug(name)}") for name in series],
            look=(0.0, 0.0, 0.72),
        )


def save_comparison(
    path: Path, motions: Mapping[str, tuple[RobotModel, Reference]], source: HumanClip | None = None
) -> None:
    """Several references side by side with the lanes of their contacts; planted soles that slide are red.

    The references' contact labels decide what is planted.

    Args:
        path: the recording.
        motions: name -> robot and reference.
        source: what they were made from, to stand at their left.
    """
    longest = max((reference for _, reference in motions.values()), key=lambda r: r.frames)
    with scene.recording(path, " | ".join(motions)) as log:
        index = scene.timelines(np.arange(longest.frames), longest.fps)
        scene.lay_floor(log, longest.body_pos_w[:, 0], index, longest.fps)
        if source is not None:
            scene.draw_source(log, source, 0)
        lanes = []
        for k, (name, (robot, reference)) in enumerate(motions.items()):
            index = scene.timelines(np.arange(reference.frames), reference.fps)
            root = f"world/{scene.slug(name)}"
            aside_m = np.array([0.0, -scene.SIDE_M * k, 0.0])
            scene.draw_robot(log, root, visual_parts(robot))
            scene.move_robot(log, root, robot, reference.body_pos_w + aside_m, reference.body_quat_w, index)
            scene.draw_soles(log, robot, reference, index, root)
            scene.label(log, f"{root}-name", name, reference.body_pos_w[:, 0] + aside_m, index)
            lanes.append(draw_contact_lanes(log, name, reference))
        text = "Soles: green planted, orange pivoting, red sliding while it is planted. Lanes: what each edge does."
        log.log("report", scene.markdown(text), static=True)
        send_blueprint(log, lanes, eye=(4.2, -0.9, 1.6), tall=len(lanes))
