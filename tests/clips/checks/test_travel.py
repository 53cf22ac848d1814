"""Feet that carry nobody: travel that is missing or in another unit is refused, with a cure that brings it back."""

import numpy as np
import pytest
from conftest import SAMPLES
from damage import read_shared, travelling

from clips import ClipError, ReadOptions, read_clip, repair
from clips.checks import check_travel, foot_points
from clips.edit import travel_from_feet, travel_scaled

CLIPS = [
    "bvh/bandai1_dance_short_normal_001.bvh", "bvh/perfume_aachan.bvh", "deepmimic/humanoid3d_walk.txt",
    "npz/asap_smpl_apt_level1.npz", "csv/g1moves/J_Dance21_Blunt.csv", "csv/g1moves/M_Move5.csv", "pkl/gmt_dance.pkl",
]  # fmt: skip


@pytest.fixture(scope="module", params=CLIPS)
def clip(request, shared):
    return repair(read_shared(shared, request.param))


@pytest.mark.parametrize("factor", [0.0, (0.0, 0.0, 1.0), 0.001, 0.01, 0.1, 10.0])
def test_travel_that_is_lost_or_in_another_unit_is_refused(clip, factor):
    with pytest.raises(ClipError, match="travel is missing, or in another unit|hips that jump"):
        repair(travelling(clip, factor))


@pytest.mark.parametrize("factor", [0.8, 1.0, 1.25])
def test_a_person_of_other_proportions_travels(clip, factor):
    """The other side of the threshold: short legs on long ways, as a file of mean proportions has them."""
    assert check_travel(travelling(clip, factor)).verdict in ("holds", "doubtful")


def test_the_factor_of_its_unit_is_named_and_brings_it_back(clip):
    check = check_travel(travelling(clip, 0.01))
    assert check.option == "travel_scale" or check.suggestion == "from-feet"
    if check.option == "travel_scale":
        assert check.suggestion == "100"
        np.testing.assert_allclose(points_of(travel_scaled(travelling(clip, 0.01), 100.0)), points_of(clip), atol=1e-9)


def points_of(clip):
    return clip.positions if hasattr(clip, "positions") else clip.root_pos


def way(clip):
    hips = foot_points(clip).pelvis[:, :2]
    return np.linalg.norm(np.diff(hips, axis=0), axis=1).sum()


@pytest.mark.parametrize("factor", [0.0, (0.0, 0.0, 1.0)])
def test_feet_bring_the_travel_back(clip, factor):
    """The way is as long as the recorded one; feet that slide make it shorter."""
    made = travel_from_feet(travelling(clip, factor))
    assert check_travel(made).verdict == "holds"
    assert way(made) == pytest.approx(way(clip), rel=0.35)


def test_the_sample_dance_is_carried_back_to_where_it_was():
    dance = read_clip(SAMPLES / "groove.bvh")
    made = travel_from_feet(travelling(dance, (0.0, 0.0, 1.0)))
    off = (made.point("pelvis") - dance.point("pelvis"))[:, :2]
    assert np.linalg.norm(off - off[0], axis=1).max() < 0.05
    unmoved = travelling(dance, 0.0)
    assert np.ptp(travel_from_feet(unmoved).point("pelvis")[:, 2]) == pytest.approx(
        np.ptp(dance.point("pelvis")[:, 2]), abs=0.03
    )


def test_a_dance_on_planted_feet_tells_nothing():
    dance = read_clip(SAMPLES / "groove.bvh")
    still = travelling(dance, 1.0)
    object.__setattr__(still, "positions", np.repeat(dance.positions[:1], dance.frames, axis=0))
    assert check_travel(still).verdict == "cannot tell"


@pytest.mark.parametrize("option", [{"travel_scale": 100.0}, {"travel": "from-feet"}])
def test_the_options_act_while_reading(tmp_path, shared, option):
    text = (shared / "bvh/cmu_12_01_walk.bvh").read_text()
    head, _, rows = text.partition("Frame Time: ")
    dt, *lines = rows.splitlines()
    small = [" ".join([*(f"{float(x) / 100:.8g}" for x in r.split()[:3]), *r.split()[3:]]) for r in lines if r.strip()]
    path = tmp_path / "small.bvh"
    path.write_text(head + "Frame Time: " + "\n".join([dt, *small]) + "\n")
    with pytest.raises(ClipError, match="travel is missing"):
        repair(read_clip(path))
    ways = [
        np.linalg.norm(np.ptp(repair(clip).point("pelvis")[:, :2], axis=0))
        for clip in (read_clip(path, ReadOptions(**option)), read_clip(shared / "bvh/cmu_12_01_walk.bvh"))
    ]
    assert ways[0] == pytest.approx(ways[1], rel=0.2)


def test_a_robots_root_in_centimetres_is_told_with_its_factor(tmp_path, shared):
    source = shared / "csv/g1moves/M_ShortMove12.csv"
    rows = np.loadtxt(source, delimiter=",")
    rows[:, :3] /= 100.0
    np.savetxt(tmp_path / "small.csv", rows, delimiter=",", fmt="%.8g")
    with pytest.raises(ClipError) as refused:
        read_clip(tmp_path / "small.csv", ReadOptions(fps=60.0))
    assert (refused.value.option, refused.value.suggestion) == ("travel_scale", "100")
    cured = read_clip(tmp_path / "small.csv", ReadOptions(fps=60.0, travel_scale=100.0))
    np.testing.assert_allclose(cured.root_pos, read_clip(source, ReadOptions(fps=60.0)).root_pos, atol=1e-6)


def test_who_slides_on_the_spot_and_says_so_is_believed(tmp_path):
    """A dance whose feet slide under a body that stays, as the running man: refused, unless its travel is stated."""
    text = (SAMPLES / "groove.bvh").read_text()
    head, _, rows = text.partition("Frame Time: ")
    dt, *lines = rows.splitlines()
    first = lines[0].split()[:3]
    (tmp_path / "spot.bvh").write_text(
        head + "Frame Time: " + "\n".join([dt, *(" ".join([*first, *r.split()[3:]]) for r in lines if r.strip())])
    )
    with pytest.raises(ClipError, match="travel is missing"):
        repair(read_clip(tmp_path / "spot.bvh"))
    kept = repair(read_clip(tmp_path / "spot.bvh", ReadOptions(travel_scale=1.0)))
    assert np.ptp(kept.point("pelvis")[:, :2], axis=0).max() < 1e-9 and check_travel(kept).verdict == "doubtful"
