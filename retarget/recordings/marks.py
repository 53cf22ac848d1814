"""Gates that do not hold, in a recording: red in the scene, a lane over time, a list to click; and lanes of contacts."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy import ndarray

from clips import FREE, GLIDING, PIVOTING, PLANTED, MetricKey, Reference
from retarget.dynamics import Dynamics
from retarget.recordings.scene import RED, Log, slug, timelines
from retarget.report import Diagnosis
from robot_models import CONTACT_NAMES, PART_NAMES, RobotModel, self_collisions
from robot_models.incoming import printable

_GREEN = (60, 190, 110, 255)
_AROUND_S = 0.5  # of a moment without a stretch, that is marked
_MISSED = "missed"
_ARROW_M, _ARROW_RADIUS_M = 1.2, 0.01  # length of an arrow as strong as the weight
_FORCE, _SMALL = (120, 200, 255, 255), 0.01  # share of the weight, below which a force is not drawn
_NOT_GIVEN = 0.5  # score from which what is missing is drawn


def mark_diagnoses(
    log: Log, robot: RobotModel, reference: Reference, found: Sequence[Diagnosis]
) -> list[Callable[[Any], Any]]:
    """Mark every gate that does not hold; returns the views, none where all hold."""
    if not found:
        return []
    for diagnosis in found:
        _draw_lane(log, diagnosis, reference)
        for points, index in _places(diagnosis, robot, reference):
            _draw_spot(log, slug(diagnosis.metric.label), points, index)
    _list_moments(log, found, reference.fps)
    return [_lanes, _bookmarks]


def _draw_lane(log: Log, diagnosis: Diagnosis, reference: Reference) -> None:
    """A lane that is red while the gate is missed."""
    import rerun as rr

    entity = f"gates/{slug(diagnosis.metric.label)}"
    log.log(entity, rr.StateConfiguration(values=[_MISSED, "holds"], colors=[RED, _GREEN]), static=True)
    changes = {0: "holds"}
    for a, b in _stretches(diagnosis):
        changes |= {round(a * reference.fps): _MISSED, round(b * reference.fps) + 1: "holds"}
    frames = np.array([t for t in changes if t < reference.frames])
    states = [changes[t] for t in frames.tolist()]
    log.send_columns(entity, timelines(frames, reference.fps), rr.StateChange.columns(state=states))


def draw_contact_lanes(log: Log, name: str, reference: Reference) -> Callable[[Any], Any]:
    """A lane for each sole edge, and each other part that touches, and what it does; returns its view."""
    import rerun as rr

    states = {FREE: "free", PLANTED: "planted", PIVOTING: "pivoting", GLIDING: "gliding"}
    colours = [(45, 48, 56, 255), _GREEN, (245, 170, 40, 255), (70, 160, 245, 255)]
    lanes = dict(zip(CONTACT_NAMES, reference.contact.T, strict=True))
    if reference.part_contact is not None:
        lanes |= {n: labels for n, labels in zip(PART_NAMES, reference.part_contact.T, strict=True) if labels.any()}
    for edge, labels in lanes.items():
        frames = np.flatnonzero(np.concatenate(([True], labels[1:] != labels[:-1])))
        entity = f"contacts/{slug(name)}/{edge}"
        log.log(entity, rr.StateConfiguration(values=list(states.values()), colors=colours), static=True)
        changes = rr.StateChange.columns(state=[states[int(labels[t])] for t in frames])
        log.send_columns(entity, timelines(frames, reference.fps), changes)
    return lambda rrb: rrb.StateTimelineView(name=f"contacts: {name}", origin=f"/contacts/{slug(name)}")


def draw_forces(log: Log, dynamics: Dynamics, index: list[Any]) -> None:
    """The forces of the floor as arrows that end where they act, and in red from the centre of mass what is missing."""
    scale = _ARROW_M / dynamics.weight
    given = scale * dynamics.force_w
    missing = scale * np.where(dynamics.score[:, None] > _NOT_GIVEN, dynamics.residual[:, :3], 0.0)[:, None]
    _draw_arrows(log, "world/forces/floor", dynamics.point_w - given, given, _FORCE, index)
    _draw_arrows(log, "world/forces/missing", dynamics.com_w[:, None], missing, RED, index)


def _draw_arrows(log: Log, entity: str, at: ndarray, along: ndarray, colour: tuple[int, ...], index: list[Any]) -> None:
    """Arrows (T, P, 3), in every frame those that are of any length."""
    import rerun as rr

    shown = np.linalg.norm(along, axis=2) > _SMALL * _ARROW_M
    log.log(entity, rr.Arrows3D.from_fields(radii=[_ARROW_RADIUS_M], colors=[colour]), static=True)
    columns = rr.Arrows3D.columns(origins=at[shown].astype(np.float32), vectors=along[shown].astype(np.float32))
    log.send_columns(entity, index, columns.partition(shown.sum(axis=1)))


def _stretches(diagnosis: Diagnosis) -> Sequence[tuple[float, float]]:
    where = diagnosis.metric.where
    if where is None:
        return ()
    return where.stretches or ((max(0.0, where.at_s - _AROUND_S), where.at_s + _AROUND_S),)


def _places(diagnosis: Diagnosis, robot: RobotModel, reference: Reference) -> list[tuple[list[ndarray], list[Any]]]:
    """Points of every frame that shall be red, with the times of these frames."""
    where = diagnosis.metric.where
    if where is None:
        return []
    seconds = np.arange(reference.frames) / reference.fps
    inside = np.zeros(reference.frames, dtype=bool)
    for a, b in _stretches(diagnosis):
        inside |= (seconds > a - 1e-6) & (seconds < b + 1e-6)
    if diagnosis.metric.key is MetricKey.SELF_COLLISION:
        points = self_collisions(robot, reference.qpos).point_w
    elif where.point_w is not None:
        points = np.tile(where.point_w, (reference.frames, 1))
    else:
        return []
    shown = [
        points[t : t + 1] if inside[t] and np.isfinite(points[t]).all() else points[:0] for t in range(len(points))
    ]
    return [(shown, timelines(np.arange(reference.frames), reference.fps))]


def _draw_spot(log: Log, name: str, points: list[ndarray], index: list[Any]) -> None:
    """A red ball where something is wrong, in the frames in which it is."""
    import rerun as rr

    entity = f"world/wrong/{name}"
    log.log(entity, rr.Points3D.from_fields(radii=[0.1], colors=[RED]), static=True)
    columns = rr.Points3D.columns(positions=np.concatenate(points).astype(np.float32))
    log.send_columns(entity, index, columns.partition([len(p) for p in points]))


def _list_moments(log: Log, found: Sequence[Diagnosis], fps: float) -> None:
    """One line per gate at its worst moment: a click on its time goes there."""
    import rerun as rr

    moments = sorted((d.metric.where.at_s if d.metric.where else 0.0, str(d)) for d in found)
    frames = np.array([round(at_s * fps) for at_s, _ in moments])
    columns = rr.TextLog.columns(text=[printable(text) for _, text in moments], level=["ERROR"] * len(moments))
    log.send_columns("bookmarks", timelines(frames, fps), columns)


def _lanes(rrb: Any) -> Any:
    return rrb.StateTimelineView(name="gates that are missed", origin="/gates")


def _bookmarks(rrb: Any) -> Any:
    return rrb.TextLogView(name="worst moments: click on a time", origin="/bookmarks")
