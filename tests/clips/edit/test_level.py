"""A world that leans is turned upright by where feet stand; a level one is left as it is."""

import numpy as np
import pytest
from conftest import SAMPLES
from damage import read_shared, tilted

from clips import ReadOptions, read_clip, repair
from clips.checks import check_floor, fit_floor, foot_points

WIDE = [  # dances that go somewhere, and walks
    "bvh/bandai1_dance_short_normal_001.bvh", "bvh/perfume_aachan.bvh", "amc/cmu_lambada.amc", "bvh/fair1_dab.bvh",
    "csv/g1moves/M_Move5.csv", "csv/g1moves/B_ForwardKarate.csv", "pkl/gmt_dance.pkl", "csv/lafan1_g1_dance2_subject1.csv",
    "pkl/twist2_yanjie_walk_001.pkl", "deepmimic/humanoid3d_walk.txt",
]  # fmt: skip
FEW = [pytest.param(file, marks=() if k % 2 else pytest.mark.slow) for k, file in enumerate(WIDE)]
ON_THE_SPOT = ["npz/asap_smpl_apt_level1.npz", "csv/g1_gangnam_style_60hz.csv", "csv/g1moves/J_Dance21_Blunt.csv"]


def lean_left_over(clip, degrees, heading):
    """The angle between the vertical and where it was before [deg]; the clip tilted, then mended."""
    mended = repair(tilted(clip, degrees, heading))
    up, was_up = foot_points(mended).up, foot_points(clip).up
    # One rotation took the one to the other; the vertical's image under it, by least squares over the clip.
    left = foot_points(mended).left, foot_points(clip).left
    now = np.concatenate((up, left[0], np.cross(up, left[0])))
    before = np.concatenate((was_up, left[1], np.cross(was_up, left[1])))
    u, _, vt = np.linalg.svd(now.T @ before)
    turn = u @ np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ vt))]) @ vt
    return np.degrees(np.arccos(np.clip(turn[2, 2], -1.0, 1.0))), mended


@pytest.mark.parametrize("degrees, heading", [(10.0, 20.0), (20.0, 250.0), (35.0, 300.0)])
@pytest.mark.parametrize("file", FEW)
def test_a_leaning_world_is_turned_upright_and_told(shared, file, degrees, heading):
    clip = repair(read_shared(shared, file))
    left, mended = lean_left_over(clip, degrees, heading)
    assert left < 1.2
    told = [r for r in mended.source.repairs if "turned upright" in r.what]
    assert len(told) == 1
    assert float(told[0].what.split("(")[1].split()[0]) == pytest.approx(degrees, abs=2.0)
    assert repair(mended) is mended


@pytest.mark.parametrize("degrees, heading", [(10.0, 20.0), (30.0, 130.0)])
@pytest.mark.parametrize("file", ON_THE_SPOT)
def test_on_the_spot_it_is_less_exact(shared, file, degrees, heading):
    left, _ = lean_left_over(repair(read_shared(shared, file)), degrees, heading)
    assert left < 3.0


@pytest.mark.parametrize(
    "file", [*WIDE, *ON_THE_SPOT, "csv/lafan1_g1_fallAndGetUp2_subject2.csv", "bvh/rokoko_jesse_dance.bvh"]
)
def test_a_level_world_stays_to_the_last_digit(shared, file):
    clip = repair(read_shared(shared, file))
    assert not any("upright" in r.what for r in clip.source.repairs)


@pytest.mark.parametrize("degrees", [0.5, 2.0])
def test_a_slight_lean_is_no_camera(degrees):
    clip = tilted(read_clip(SAMPLES / "groove.bvh"), degrees, 70.0)
    assert not any("upright" in r.what for r in repair(clip).source.repairs)
    assert check_floor(clip).verdict == "holds"


def test_a_floor_that_shall_stay_stays(tmp_path, shared):
    clip = read_shared(shared, "bvh/fair1_dab.bvh")
    leaning = tilted(clip, 20.0, 45.0)
    stated = read_clip(shared / "bvh/fair1_dab.bvh", ReadOptions(level=False)).source
    kept = repair(tilted(read_clip(shared / "bvh/fair1_dab.bvh", ReadOptions(level=False)), 20.0, 45.0))
    assert stated.stated("floor") and not any("upright" in r.what for r in kept.source.repairs)
    assert any("upright" in r.what for r in repair(leaning).source.repairs)


def test_two_roads_to_one_plane(shared):
    """The fitted slope against least squares through the lowest places of a long walk's feet."""
    clip = tilted(repair(read_shared(shared, "csv/lafan1_g1_dance2_subject1.csv")), 15.0, 200.0)
    feet = foot_points(clip)
    points = feet.points.reshape(clip.frames, -1, 3)
    slow = np.linalg.norm(np.diff(points, axis=0), axis=-1) * clip.fps < 0.05
    stands = points[1:][slow]
    rows = np.c_[stands[:, :2] - stands[:, :2].mean(axis=0), np.ones(len(stands))]
    plain = np.linalg.lstsq(rows, stands[:, 2], rcond=None)[0][:2]
    np.testing.assert_allclose(fit_floor(feet, clip.fps).slope, plain, atol=0.01)
