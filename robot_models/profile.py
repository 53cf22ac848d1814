"""What a robot is, as data: one TOML file per robot, read and checked here.

Numbers that go to many joints stand under full-match patterns; a pattern that matches no joint is an error,
and so is a joint that no pattern covers.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from robot_models.errors import RobotError
from robot_models.incoming import MAX_CONFIG, MAX_NAME, check_pattern, file_name, parsed, printable, read_text

PROFILES = Path(__file__).parent / "profiles"
_LONGEST_M = 2.0  # of a forearm: no robot's is as long
_LARGEST = 1e6  # number of a profile: no gain, torque or length of a robot comes near
FEET = ("left", "right")
LANDMARKS = (
    "pelvis", "torso", "head",
    "left_hip", "left_knee", "left_foot", "right_hip", "right_knee", "right_foot",
    "left_shoulder", "left_elbow", "left_wrist", "right_shoulder", "right_elbow", "right_wrist",
)  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Source:
    """Where the model file lies: beside the profile, or inside an installed Python package."""

    path: str  # relative to the profile's folder, or to the package's
    package: str = ""  # import name, or "" for a file of our own
    licence: str
    origin: str  # whose model it is and which version
    install: str = ""  # command that brings the package
    inertia: str = "exact"  # "exact", or "repair" where the file has massless or impossible inertias
    upright: tuple[str, ...] = ()  # bodies whose frames are turned to the world's at zero, as feet's have to be
    yaw: float = 0.0  # by how much the robot is turned for that, to face +x [rad]


@dataclass(frozen=True, kw_only=True)
class Sole:
    """Flat patch under one foot, in the frame of `body`; the same patch serves height, contact and support."""

    body: str
    x: tuple[float, float]  # back and front edge [m]
    y: tuple[float, float]  # right and left edge [m]
    z: float  # height of the patch in the body frame [m], negative
    points: tuple[tuple[float, float], ...]  # (x, y) of the contact points of every physics engine [m]

    @property
    def heel(self) -> tuple[float, float, float]:
        """Middle of the back edge."""
        return (self.x[0], 0.5 * sum(self.y), self.z)

    @property
    def toe(self) -> tuple[float, float, float]:
        """Middle of the front edge."""
        return (self.x[1], 0.5 * sum(self.y), self.z)

    @property
    def corners(self) -> Float[ndarray, "4 3"]:
        """Two back corners, then two front corners."""
        return np.array([(x, y, self.z) for x in self.x for y in self.y])


@dataclass(frozen=True, kw_only=True)
class Capsule:
    """A self-collision capsule added to a body, in that body's frame."""

    name: str
    body: str
    start: tuple[float, float, float]  # [m]
    end: tuple[float, float, float]  # [m]
    radius: float  # [m]


@dataclass(frozen=True, kw_only=True)
class RobotProfile:
    """One robot, as its profile file says it. Tables map a full-match pattern of joint names to a number."""

    name: str
    title: str
    folder: Path
    source: Source
    meshes: Source | None
    root: str
    freeze: tuple[str, ...]  # joints welded at zero (fingers, grippers)
    kp: Mapping[str, float]  # [N m/rad]
    kd: Mapping[str, float]  # [N m s/rad]
    armature: Mapping[str, float]  # [kg m^2]
    effort: Mapping[str, float]  # [N m]
    velocity: Mapping[str, float]  # [rad/s]
    damping: Mapping[str, float]  # [N m s/rad]
    default_pose: Mapping[str, float]  # [rad], joints not named stand at 0
    friction: float  # of the soles, Coulomb
    soles: Mapping[str, Sole]  # "left", "right"
    capsules: tuple[Capsule, ...]
    excludes: tuple[tuple[str, str], ...]  # body pairs that may overlap
    motor_pairs: tuple[tuple[str, str], ...]  # joints that two motors move together, through rods
    landmarks: Mapping[str, str]  # LANDMARKS -> body
    ends: Mapping[
        str, tuple[float, float, float]
    ]  # where a landmark lies in its body's frame, if not at its origin [m]
    anchor: str
    tracked: tuple[str, ...]  # bodies of the tracking task
    imu: str  # site of the gyro
    csv_columns: tuple[str, ...]  # joint column names of the robot's own CSV, in file order
    variants: Mapping[str, tuple[str, ...]]  # name -> patterns of joints that this variant of the robot lacks
    # What the robot's servos stand, lowest and highest; empty where nobody has said, and no policy is sent to it.
    kp_band: Mapping[str, tuple[float, float]]  # [N m/rad]
    kd_band: Mapping[str, tuple[float, float]]  # [N m s/rad]


def expand_patterns(
    table: Mapping[str, float], joint_names: Sequence[str], *, where: str, cover: bool = True
) -> list[float]:
    """One number per joint from a pattern table; later patterns win.

    Raises:
        RobotError: a pattern matches no joint, or `cover` is set and a joint is matched by none.
    """
    values: dict[str, float] = {}
    for pattern, value in table.items():
        hits = [j for j in joint_names if re.fullmatch(pattern, j)]
        if not hits:
            raise RobotError(
                f"{where} pattern '{pattern}'",
                found="no such joint",
                expected=f"a full match among {', '.join(joint_names)}",
            )
        values.update(dict.fromkeys(hits, float(value)))
    missing = [j for j in joint_names if j not in values]
    if cover and missing:
        raise RobotError(where, found=f"no value for {', '.join(missing)}", expected="one pattern for every joint")
    return [values.get(j, 0.0) for j in joint_names]


def read_profile(path: Path) -> RobotProfile:
    """Read and check one profile file.

    Raises:
        RobotError: the file is absent, is not TOML, or lacks or mistypes an entry.
    """
    text = read_text(path, expected="a robot profile (TOML)", most=MAX_CONFIG, error=RobotError)
    data = parsed(tomllib.loads, text, str(path), expected="a robot profile (TOML)", error=RobotError)
    try:
        profile = _parse(data, path)
    except KeyError as e:
        raise RobotError(str(path), found=f"no entry {e}", expected="a full profile", cure="see docs/robots.md") from e
    except (AttributeError, TypeError, ValueError) as e:
        raise RobotError(str(path), found=f"an entry of the wrong kind ({e})", expected="a full profile") from e
    _check(profile, str(path))
    return profile


def _check(profile: RobotProfile, where: str) -> None:
    """Refuse what is of the right kind and still no robot's.

    Raises:
        RobotError: a name that is none, a number that is none, or a pattern that may not end.
    """
    words = (
        profile.name,
        profile.title,
        profile.root,
        profile.anchor,
        profile.imu,
        *profile.tracked,
        *profile.csv_columns,
    )
    pairs = (*profile.excludes, *profile.motor_pairs)
    words += (*profile.landmarks.values(), *profile.variants, *(x for pair in pairs for x in pair))
    for word in words:
        if not isinstance(word, str) or len(word) > MAX_NAME or not word.isprintable():
            raise RobotError(
                where, found=printable(repr(word)[:60]), expected=f"a word of at most {MAX_NAME} characters"
            )
    if file_name(profile.name) != profile.name:
        raise RobotError(
            f"{where}, name", found=repr(profile.name), expected="a name that can be a file's: letters, digits, _ - ."
        )
    for key in ("kp", "kd", "armature", "effort", "velocity", "damping", "default_pose"):
        for pattern, value in getattr(profile, key).items():
            check_pattern(pattern, f"{where}, {key}", error=RobotError)
            number = isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= _LARGEST
            if not number or (value < 0.0 and key != "default_pose"):
                raise RobotError(
                    f"{where}, {key} of {pattern}", found=repr(value)[:60], expected="a finite number, not below 0"
                )
    for pattern in (
        *profile.freeze,
        *profile.kp_band,
        *profile.kd_band,
        *(p for v in profile.variants.values() for p in v),
    ):
        check_pattern(pattern, where, error=RobotError)
    if not 0.0 < profile.friction <= _LARGEST:
        raise RobotError(f"{where}, friction", found=repr(profile.friction), expected="a finite number above 0")


def _source(table: dict[str, Any]) -> Source:
    return Source(**{**table, "upright": tuple(table.get("upright", ()))})


def _parse(data: dict[str, Any], path: Path) -> RobotProfile:
    joints, soles = data["joints"], data["soles"]
    return RobotProfile(
        name=data["name"],
        title=data["title"],
        folder=path.parent,
        source=_source(data["source"]),
        meshes=Source(**data["meshes"]) if "meshes" in data else None,
        root=data["root"],
        freeze=tuple(data.get("freeze", ())),
        kp=joints["kp"],
        kd=joints["kd"],
        armature=joints["armature"],
        effort=joints.get("effort", {}),
        velocity=joints.get("velocity", {}),
        damping=joints.get("damping", {}),
        default_pose=data.get("default_pose", {}),
        friction=float(data.get("friction", 1.0)),
        soles={side: _sole(soles[side]) for side in FEET},
        capsules=tuple(
            Capsule(name=n, body=c["body"], start=tuple(c["from"]), end=tuple(c["to"]), radius=c["radius"])
            for n, c in data.get("capsules", {}).items()
        ),
        excludes=tuple((a, b) for a, b in data.get("excludes", ())),
        motor_pairs=tuple((a, b) for a, b in data.get("motor_pairs", ())),
        landmarks={k: data["landmarks"][k] for k in LANDMARKS},
        ends=_ends(data.get("ends", {})),
        anchor=data["tracking"]["anchor"],
        tracked=tuple(data["tracking"]["bodies"]),
        imu=data["tracking"].get("imu", ""),
        csv_columns=tuple(data.get("csv_columns", ())),
        variants={k: tuple(v) for k, v in data.get("variants", {}).items()},
        kp_band=_bands(joints.get("kp_band", {})),
        kd_band=_bands(joints.get("kd_band", {})),
    )


def _ends(table: dict[str, Any]) -> dict[str, tuple[float, float, float]]:
    """Wrists of arms that end at the elbow, which have no body of their own."""
    ends = {name: (float(x), float(y), float(z)) for name, (x, y, z) in table.items()}
    for name, end in ends.items():
        if not name.endswith("_wrist") or name not in LANDMARKS or not np.all(np.abs(end) < _LONGEST_M):
            raise ValueError(f"end {name}: a wrist, and metres")
    return ends


def _bands(table: dict[str, Any]) -> dict[str, tuple[float, float]]:
    bands = {pattern: (float(lowest), float(highest)) for pattern, (lowest, highest) in table.items()}
    for pattern, (lowest, highest) in bands.items():
        if not 0.0 <= lowest <= highest < np.inf:
            raise ValueError(f"band of {pattern}: {lowest} to {highest}")
    return bands


def _sole(entry: dict[str, Any]) -> Sole:
    return Sole(
        body=entry["body"],
        x=tuple(entry["x"]),
        y=tuple(entry["y"]),
        z=float(entry["z"]),
        points=tuple((float(px), float(py)) for px, py in entry["points"]),
    )
