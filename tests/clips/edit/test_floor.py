"""A floor that drifts and leans is found from standing feet, wherever the dancer is and whichever way it faces."""

from dataclasses import replace

import numpy as np
import pytest
from stick_person import NAMES, person, points, robot_clip

from clips.edit.align import placed
from clips.edit.floor import on_level_floor
from robot_models.maths import rotation as rot

FPS, FRAMES = 30.0, 240


@pytest.fixture(scope="module")
def steps():
    """Somebody who goes round on a level floor: a foot stands for half a second while the other goes on."""
    places = points(FRAMES, FPS)
    phase, half = np.divmod(np.arange(FRAMES) / FPS, 0.5)
    angle = np.linspace(0.0, 2 * np.pi, 17)  # of every step on a circle of one metre
    for side, first in (("left", 0), ("right", 1)):
        moves = (phase + first) % 2 == 0
        begin = np.clip(phase - np.where(moves, 0, 1), 0, 16).astype(int)
        share = np.where(moves, 0.5 - 0.5 * np.cos(np.pi * half / 0.5), 1.0)
        end = np.minimum(begin + 2, 16)
        a = angle[begin] + share * (angle[end] - angle[begin])
        for part in ("ankle", "toe"):
            k = NAMES.index(f"{side}_{part}")
            places[:, k, 0] += np.cos(a) - 1.0
            places[:, k, 1] += np.sin(a)
            places[:, k, 2] += np.where(moves, 0.15 * np.sin(np.pi * half / 0.5), 0.0)
    body = [k for k, n in enumerate(NAMES) if not n.endswith(("ankle", "toe"))]
    way = angle[phase.astype(int)] + half / 0.5 * (angle[1] - angle[0])
    places[:, body, 0] += (np.cos(way) - 1.0)[:, None]
    places[:, body, 1] += np.sin(way)[:, None]
    return person(FRAMES, FPS, positions=places)


def tilted(clip, drift=0.0, east=0.0, north=0.0):
    """The clip as a camera that sinks and leans would have it."""
    lift = drift * np.arange(clip.frames)[:, None] / clip.fps + clip.positions[..., :2] @ [east, north]
    return replace(clip, positions=clip.positions + lift[..., None] * [0.0, 0.0, 1.0])


def height_of_standing_feet(clip, level):
    """Heights of ankles where the level clip's are on the floor, against time and place."""
    k = NAMES.index("left_ankle")
    return clip.positions[level.positions[:, k, 2] < 0.081, k, 2]


def test_a_level_floor_is_left_alone(steps):
    assert on_level_floor(steps) is steps


@pytest.mark.parametrize(
    "floor", [{"drift": 0.03}, {"drift": -0.02}, {"east": 0.06}, {"north": -0.05}, {"drift": 0.02, "east": 0.04}]
)
def test_standing_feet_are_level_again(steps, floor):
    bent = tilted(steps, **floor)
    level = on_level_floor(bent)
    before, after = (np.ptp(height_of_standing_feet(c, steps)) for c in (bent, level))
    # Within the scatter by which a standing foot is weighed, 3 mm, each way.
    assert after < 0.006 < 0.04 < before
    assert on_level_floor(level) is level


def test_the_drift_and_the_lean_on_record_are_those_that_were_made(steps):
    repair = on_level_floor(tilted(steps, drift=0.03, north=0.05)).source.repairs[-1]
    assert "drifts by 3.0 cm/s and leans by 5.0 %" in repair.what and repair.count == FRAMES


@pytest.mark.parametrize("angle", [0.8, 2.5])
def test_the_answer_turns_with_the_world(steps, angle):
    bent = tilted(steps, drift=0.02, east=0.05)
    one = placed(on_level_floor(bent), angle, np.array([3.0, -2.0, 0.0]), "")
    other = on_level_floor(placed(bent, angle, np.array([3.0, -2.0, 0.0]), ""))
    # Robust fits end within their tolerance: the axes they are written in are others.
    np.testing.assert_allclose(other.positions, one.positions, atol=1e-4)


def test_nothing_is_bent_and_points_turn_with_their_bones(steps):
    bent = tilted(steps, drift=0.02, east=0.05)
    level = on_level_floor(bent)
    a, b = NAMES.index("left_knee"), NAMES.index("left_hip")
    seen = [
        rot.rotate(rot.conjugate(c.orientations[:, b]), c.positions[:, a] - c.positions[:, b]) for c in (bent, level)
    ]
    np.testing.assert_allclose(*seen, atol=1e-9)
    still = replace(level, orientations=bent.orientations)  # negative control: points turned, frames not
    other = rot.rotate(rot.conjugate(still.orientations[:, b]), still.positions[:, a] - still.positions[:, b])
    assert np.abs(other - seen[0]).max() > 0.005


def test_a_foot_that_is_held_still_in_the_air_is_no_floor(steps):
    bent = tilted(steps, drift=0.02, east=0.05)
    held = bent.positions.copy()
    for part in ("ankle", "toe"):
        k = NAMES.index(f"left_{part}")
        held[90:130, k] = held[90, k] + [0.0, 0.0, 0.05]
    plain, balanced = on_level_floor(bent), on_level_floor(replace(bent, positions=held))
    k = NAMES.index("right_ankle")
    np.testing.assert_allclose(balanced.positions[:, k], plain.positions[:, k], atol=0.01)


def test_robots_and_those_who_never_stand_are_left_alone(steps):
    robot = robot_clip()
    assert on_level_floor(robot) is robot
    flying = steps.positions + np.arange(FRAMES)[:, None, None] / FPS * [1.0, 0.0, 0.0]  # 1 m/s at all times
    bent = tilted(replace(steps, positions=flying), drift=0.05)
    assert on_level_floor(bent) is bent
