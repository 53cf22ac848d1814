"""What a Rerun recording is made of: with `blueprint` and `marks` the ones that know Rerun.

Static things are logged once, whole series by column, on two timelines (frame, seconds). A camera frame follows the
robot, and a file is whole or absent.
"""

from __future__ import annotations

import os
import uuid
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy import ndarray

from clips import GLIDING, PIVOTING, PLANTED, HumanClip, Reference, write_whole
from retarget.report import Diagnosis, Report
from retarget.targets import Targets
from robot_models import FEET, Part, RobotModel, heel_toe_positions
from robot_models.incoming import printable
from robot_models.maths import rotation as rot
from robot_models.maths import smooth

Log = Any  # rerun.RecordingStream
SIDE_M = 1.1  # figures stand this far from each other
_SLIDING = 0.03  # a planted edge faster than this is drawn red [m/s]
_GREY, _GREEN, _ORANGE, _BLUE = (120, 125, 135, 255), (60, 190, 110, 255), (245, 170, 40, 255), (70, 160, 245, 255)
RED = (230, 55, 45, 255)
_SOURCE, _TARGET, GHOST = (90, 170, 255), (255, 205, 70), (120, 150, 190, 90)
_SPACE = uuid.UUID("6ad2c0de-5b5e-4c5c-9d0a-0d3a2c1e77aa")


def label(log: Log, entity: str, text: str, root_pos: ndarray, index: list[Any]) -> None:
    """A name over a figure's head."""
    import rerun as rr

    log.log(entity, rr.Points3D.from_fields(radii=[0.001], labels=[printable(text)], show_labels=True), static=True)
    above = (root_pos + np.array([0.0, 0.0, 0.75])).astype(np.float32)
    log.send_columns(entity, index, rr.Points3D.columns(positions=above))


@contextmanager
def recording(path: Path, title: str) -> Iterator[Log]:
    """A recording that is whole or absent: it is kept in memory and written at the end."""
    # Before the import: what is shown depends on the motion alone. Bytes still differ: Rerun's chunks have ids of their own.
    os.environ.setdefault("RERUN_LOG_TIME", "0")
    import rerun as rr

    rr.set_strict_mode(True)
    title = printable(title)
    log = rr.RecordingStream(
        "dance-retarget", recording_id=str(uuid.uuid5(_SPACE, f"{title}/{printable(path.name)}")), send_properties=False
    )
    # In memory first: Rerun's own file writer only logs that a disk was full.
    memory = log.memory_recording()
    log.send_recording_name(title)
    yield log
    log.flush(timeout_sec=60.0)
    with write_whole(path) as stream:
        stream.write(memory.drain_as_bytes() or b"")
    log.disconnect()


def timelines(frames: ndarray, fps: float) -> list[Any]:
    """The two columns that everything moving is logged by."""
    import rerun as rr

    nanoseconds = np.round(frames / fps * 1e9).astype(np.int64).astype("timedelta64[ns]")
    return [rr.TimeColumn("frame", sequence=frames), rr.TimeColumn("seconds", duration=nanoseconds)]


def lay_floor(log: Log, root_pos: ndarray, index: list[Any], fps: float) -> None:
    """Axes, floor lines, and the frame that the camera stands in: the root's smoothed path on the ground."""
    import rerun as rr

    log.log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    low = np.floor(root_pos[:, :2].min(axis=0) - 3.0)
    high = np.ceil(root_pos[:, :2].max(axis=0) + 3.0)
    lines = [[(x, low[1], 0.0), (x, high[1], 0.0)] for x in np.arange(low[0], high[0] + 0.5)]
    lines += [[(low[0], y, 0.0), (high[0], y, 0.0)] for y in np.arange(low[1], high[1] + 0.5)]
    radius = rr.components.Radius.ui_points(0.6)
    log.log("world/floor", rr.LineStrips3D(lines, colors=[(70, 76, 88)], radii=[radius]), static=True)
    path = np.zeros((len(root_pos), 3))
    path[:, :2] = smooth(root_pos[:, :2], fps, 0.3)
    log.send_columns("world/follow", index, rr.Transform3D.columns(translation=path.astype(np.float32)))


def draw_robot(log: Log, root: str, parts: Sequence[Part], tint: tuple[int, ...] | None = None) -> None:
    """The robot's surface, once."""
    import rerun as rr

    for i, part in enumerate(parts):
        entity = f"{root}/{part.body}/{part.kind}_{i}"
        pose = rr.InstancePoses3D(translations=[_middle(part)], quaternions=[rot.to_quat_xyzw(part.quat)])
        log.log(entity, _shape(part, tint), *([] if part.kind == "mesh" else [pose]), static=True)


def _normals(part: Part) -> ndarray:
    """Vertex normals: without them a mesh is drawn flat."""
    vertices, faces = np.asarray(part.vertices), np.asarray(part.faces)
    corner = vertices[faces]
    face = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    normals = np.zeros_like(vertices)
    for k in range(3):
        np.add.at(normals, faces[:, k], face)
    return rot.unit(normals)


def move_robot(log: Log, root: str, robot: RobotModel, pos: ndarray, quat: ndarray, index: list[Any]) -> None:
    """Where its bodies are, in every frame."""
    import rerun as rr

    for b, name in enumerate(robot.body_names):
        log.send_columns(
            f"{root}/{name}",
            index,
            rr.Transform3D.columns(
                translation=pos[:, b].astype(np.float32), quaternion=rot.to_quat_xyzw(quat[:, b]).astype(np.float32)
            ),
        )


def draw_figures(
    log: Log,
    root: str,
    parts: Sequence[Part],
    robot: RobotModel,
    poses: Sequence[tuple[ndarray, ndarray]],
    index: list[Any],
    tint: tuple[int, ...] | None = None,
) -> None:
    """Several of one robot, its surface stored once; each is there until its own last frame.

    Args:
        log: the recording.
        root: entity of them all.
        parts: the robot's surface.
        robot: the robot.
        poses: of each, world positions (N, B, 3) and quaternions (N, B, 4) of its bodies.
        index: times of the longest.
        tint: one colour for all of it.
    """
    import rerun as rr

    frames = max(len(pos) for pos, _ in poses)
    there = np.array([np.arange(frames) < len(pos) for pos, _ in poses])
    for i, part in enumerate(parts):
        b, entity = robot.body_names.index(part.body), f"{root}/{part.body}/{part.kind}_{i}"
        at, turn = np.zeros((len(poses), frames, 3)), np.tile([1.0, 0.0, 0.0, 0.0], (len(poses), frames, 1))
        for k, (pos, quat) in enumerate(poses):
            own = np.broadcast_to(part.quat, quat[:, b].shape)
            turn[k, : len(pos)] = rot.multiply(quat[:, b], own)
            at[k, : len(pos)] = pos[:, b] + rot.rotate(quat[:, b], np.broadcast_to(_middle(part), pos[:, b].shape))
        log.log(entity, _shape(part, tint), static=True)
        columns = rr.InstancePoses3D.columns(
            translations=at.swapaxes(0, 1)[there.T].astype(np.float32),
            quaternions=rot.to_quat_xyzw(turn.swapaxes(0, 1)[there.T]).astype(np.float32),
        )
        log.send_columns(entity, index, columns.partition(there.sum(axis=0)))


def _middle(part: Part) -> ndarray:
    """Where a part's shape has its origin: Rerun's capsule begins there and runs along z; MuJoCo's is centred."""
    if part.kind != "capsule":
        return part.pos
    return np.asarray(part.pos - rot.rotate(part.quat, np.array([0.0, 0.0, part.size[1]])))


def _shape(part: Part, tint: tuple[int, ...] | None) -> Any:
    """A part at its own origin."""
    import rerun as rr

    colour = tint or tuple(int(255 * c) for c in part.rgba)
    look: dict[str, Any] = {"colors": [colour], "fill_mode": "solid"}
    if part.kind == "box":
        return rr.Boxes3D(half_sizes=[part.size], **look)
    if part.kind == "mesh":
        vertices, faces, normals = part.vertices, part.faces, _normals(part)
        return rr.Mesh3D(
            vertex_positions=vertices, triangle_indices=faces, vertex_normals=normals, albedo_factor=colour
        )
    if part.kind == "cylinder":
        return rr.Cylinders3D(lengths=[2 * part.size[1]], radii=[part.size[0]], **look)
    if part.kind in ("sphere", "ellipsoid"):
        half = part.size if part.kind == "ellipsoid" else np.full(3, part.size[0])
        return rr.Ellipsoids3D(half_sizes=[half], **look)
    return rr.Capsules3D(lengths=[2 * part.size[1]], radii=[part.size[0]], **look)


def draw_soles(log: Log, robot: RobotModel, reference: Reference, index: list[Any], root: str = "world/robot") -> None:
    """Half soles in the colour of their contact: green planted, orange pivoting, blue gliding, red sliding while planted."""
    import rerun as rr

    edges = heel_toe_positions(robot, reference.body_pos_w, reference.body_quat_w)
    speed = np.linalg.norm(np.diff(edges[..., :2], axis=0, prepend=edges[:1, :, :2]), axis=-1) * reference.fps
    colours = np.full((reference.frames, 4, 4), _GREY, dtype=np.uint8)
    colours[reference.contact == PLANTED] = _GREEN
    colours[reference.contact == PIVOTING] = _ORANGE
    colours[reference.contact == GLIDING] = _BLUE
    colours[(reference.contact == PLANTED) & (speed > _SLIDING)] = RED
    for k, side in enumerate(FEET):
        sole = robot.soles[side]
        middle = 0.5 * sum(sole.x)
        for e, (edge, x) in enumerate((("heel", (sole.x[0], middle)), ("toe", (middle, sole.x[1])))):
            entity = f"{root}/{sole.body}/{edge}"
            half = [0.5 * (x[1] - x[0]), 0.5 * (sole.y[1] - sole.y[0]), 0.006]
            centre = [0.5 * sum(x), 0.5 * sum(sole.y), sole.z + 0.006]
            log.log(entity, rr.Boxes3D.from_fields(half_sizes=[half], centers=[centre], fill_mode="solid"), static=True)
            log.send_columns(entity, index, rr.Boxes3D.columns(colors=colours[:, 2 * k + e]))


def draw_source(log: Log, source: HumanClip, start: int) -> None:
    """The recorded figure at its own size, beside the robot."""
    import rerun as rr

    index = timelines(np.arange(start, start + source.frames), source.fps)
    points = (source.positions + np.array([0.0, SIDE_M, 0.0])).astype(np.float32)
    bones = [(p, k) for k, p in enumerate(source.parents) if p >= 0]
    strips = points[:, np.array(bones)] if bones else points[:, :0].reshape(len(points), 0, 2, 3)
    log.log("world/source", rr.LineStrips3D.from_fields(radii=[0.014], colors=[_SOURCE]), static=True)
    log.send_columns(
        "world/source",
        index,
        rr.LineStrips3D.columns(strips=strips.reshape(-1, 2, 3)).partition(np.full(len(points), len(bones))),
    )


def draw_targets(log: Log, t: Targets, r: Reference, robot: RobotModel) -> None:
    """The goals of the solver in the robot's size: pelvis, feet, and each limb from where it begins."""
    import rerun as rr

    at = {k: robot.landmark_pos((k,), r.body_pos_w[r.dance], r.body_quat_w[r.dance])[:, 0] for k, _ in t.limbs}
    ends = [at[start] + vector for (start, _), vector in t.limbs.items()]
    objective = np.stack([t.pelvis_pos, *ends, t.feet.pos[:, 0], t.feet.pos[:, 1]], axis=1).astype(np.float32)
    index = timelines(np.arange(r.dance.start, r.dance.start + len(objective)), t.fps)
    log.log("world/targets", rr.Points3D.from_fields(radii=[0.022], colors=[_TARGET]), static=True)
    columns = rr.Points3D.columns(positions=objective.reshape(-1, 3)).partition(
        np.full(len(objective), objective.shape[1])
    )
    log.send_columns("world/targets", index, columns)


def plot_curves(log: Log, root: str, series: Mapping[str, ndarray], index: list[Any]) -> None:
    """Series by frame, (N,) or (N, k) with a line for each."""
    import rerun as rr

    for name, values in series.items():
        table = values.reshape(len(values), -1)
        names = [name] if table.shape[1] == 1 else [f"{s} {e}" for s in FEET for e in ("heel", "toe")]
        entity = f"{root}/{slug(name)}"
        log.log(
            entity, rr.SeriesLines(names=names, widths=[1.5] * len(names), aggregation_policy="MinMax"), static=True
        )
        log.send_columns(entity, index, rr.Scalars.columns(scalars=table.astype(np.float32)))


def plot_learning(log: Log, curves: Mapping[str, tuple[ndarray, ndarray]]) -> None:
    """Learning curves over million steps: bars, because a time series would follow the dance's clock."""
    import rerun as rr

    for name, (steps, values) in curves.items():
        where = np.asarray(steps) / 1e6
        width = 0.8 * float(np.diff(where).min()) if len(where) > 1 else 0.1
        chart = rr.BarChart(values, abscissa=where, widths=np.full(len(where), width), color=_SOURCE)
        log.log(f"plots/learning/{slug(name)}", chart, static=True)


def markdown(text: str) -> Any:
    """A document for the recording."""
    import rerun as rr

    return rr.TextDocument(printable(text), media_type=rr.MediaType.MARKDOWN)


def report_text(report: Report, diagnoses: Sequence[Diagnosis], sources: Sequence[HumanClip]) -> str:
    """Gates, why they do not hold, and what the reader found in each of the clips, as markdown."""
    rows = [
        f"| {'' if m.limit is None else 'ok' if m.passed else '**FAIL**'} | {m.label} | {m.value:.4g} {m.unit} | "
        f"{'' if m.limit is None else f'{m.limit:.4g}'} |"
        for m in report.metrics
    ]
    missed = "\n".join(f"- **{d}**" for d in diagnoses)
    verdict = "Every gate holds." if report.passed else f"Gates that are missed:\n{missed}"
    table = "\n".join(["| | measured | value | gate |", "|---|---|---|---|", *rows])
    found = {s.source.file: f"{s.source.dialect}\n\n" + "\n".join(f"- {f}" for f in s.source.findings) for s in sources}
    recognised = "\n\n".join(f"## Recognised: {file}\n{text}" for file, text in found.items())
    return f"# {', '.join(found)}\n{verdict}\n\n{table}\n\n{recognised}\n"


def slug(name: str) -> str:
    """A name as part of an entity's path."""
    return "-".join("".join(c if c.isalnum() else " " for c in name.lower()).split())
