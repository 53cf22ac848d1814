"""C3D: markers of the known sets become joints; what a file leaves open or contradicts is refused."""

import numpy as np
import pytest

ezc3d = pytest.importorskip("ezc3d")

from clips import ClipError, ReadOptions, read_clip, repair
from clips.identify import UnknownSkeletonError

# Someone who stands facing +x, arms out: metres, z up. Outer and inner markers lie 40 mm off each joint.
STANDING = {
    "{S}ASI": (0.10, 0.13, 1.00), "{S}PSI": (-0.10, 0.05, 1.02), "{S}KNE": (0.03, 0.16, 0.50), "{S}ANK": (0.0, 0.14, 0.08),
    "{S}TOE": (0.20, 0.10, 0.03), "{S}SHO": (0.0, 0.18, 1.45), "{S}ELB": (0.0, 0.46, 1.40), "{S}WRA": (0.03, 0.70, 1.40),
    "{S}WRB": (-0.03, 0.70, 1.40),
}  # fmt: skip
CMU = {"{S}ASI": "{S}FWT", "{S}PSI": "{S}BWT"}
QUALISYS = {
    "{S}ASI": "Waist{S}Front", "{S}PSI": "Waist{S}Back", "{S}KNE": "{S}KneeOut", "{S}ANK": "{S}AnkleOut", "{S}TOE": "{S}ToeTip",
    "{S}SHO": "{S}ShoulderTop", "{S}ELB": "{S}ElbowOut", "{S}WRA": "{S}WristOut", "{S}WRB": "{S}WristIn",
}  # fmt: skip
FRAMES = 40


def standing(renamed=None):
    """Markers of both sides over time, swaying a little: name -> (T, 3)."""
    sway = 0.01 * np.sin(np.arange(FRAMES) / 8.0)[:, None] * [1.0, 0.0, 0.0]
    both = {}
    for name, place in STANDING.items():
        name = (renamed or {}).get(name, name)
        both[name.format(S="L")] = np.array(place) + sway
        both[name.format(S="R")] = np.array(place) * [1.0, -1.0, 1.0] + sway
    return both


def write(path, markers, *, scale=1000.0, unit="mm", rate=100.0, labels=None):
    file = ezc3d.c3d()
    file["parameters"]["POINT"]["RATE"]["value"] = [rate]
    file["parameters"]["POINT"]["UNITS"]["value"] = [unit]
    file["parameters"]["POINT"]["LABELS"]["value"] = labels or list(markers)
    xyz = scale * np.stack(list(markers.values()))
    file["data"]["points"] = np.concatenate((np.moveaxis(xyz, -1, 0), np.ones((1, *xyz.shape[:2]))))
    file.write(str(path))
    return path


@pytest.mark.parametrize(
    ("renamed", "name"), [({}, "Plug-in Gait"), (CMU, "CMU"), (QUALISYS, "Qualisys / Motive")], ids=["gait", "cmu", "q"]
)
def test_joints_lie_where_anatomy_puts_them(tmp_path, renamed, name):
    clip = read_clip(write(tmp_path / "stand.c3d", standing(renamed)))
    found = {f.what: f for f in clip.source.findings}
    assert (found["marker set"].value, found["unit"].value, clip.fps) == (name, "mm", 100.0)
    # Bell: 14 % of the 260 mm between the front bones inwards, 30 % down, 19 % back. The pelvis' own axes lean: its back
    # markers are 20 mm higher than the front ones over 200 mm.
    lean = np.hypot(0.2, 0.02)
    ahead, up = np.array([0.2, 0.0, -0.02]) / lean, np.array([0.02, 0.0, 0.2]) / lean
    hip = np.array([0.10, 0.13, 1.00]) + 0.26 * (np.array([0.0, -0.14, 0.0]) - 0.30 * up - 0.19 * ahead)
    np.testing.assert_allclose(clip.point("left_hip")[0], hip, atol=1e-6)
    np.testing.assert_allclose(clip.point("right_hip")[0], hip * [1.0, -1.0, 1.0], atol=1e-6)
    np.testing.assert_allclose(clip.point("left_wrist")[0], [0.0, 0.70, 1.40], atol=1e-6)
    knee = clip.point("left_knee")[0]
    assert np.linalg.norm(knee - [0.03, 0.16, 0.50]) == pytest.approx(0.057, abs=1e-6)
    assert knee[1] < 0.11  # inside of its marker
    np.testing.assert_allclose(clip.point("right_knee")[0], knee * [1.0, -1.0, 1.0], atol=1e-6)


def test_an_inner_marker_settles_the_joint(tmp_path):
    markers = standing()
    markers |= {f"{s}KNM": markers[f"{s}KNE"] * [1.0, 0.25, 1.0] for s in "LR"}
    clip = read_clip(write(tmp_path / "stand.c3d", markers))
    np.testing.assert_allclose(clip.point("left_knee")[0], [0.03, 0.10, 0.50], atol=1e-6)


def test_a_subjects_prefix_doubles_strays_and_angles_are_left_out_and_counted(tmp_path):
    markers = standing()
    labels = [f"Ana:{n}" for n in markers] + ["Ana:LKNE", "*17"]
    markers |= {"twice": markers["LKNE"] + 0.3, "stray": markers["LKNE"] + 1.0}
    clip = read_clip(write(tmp_path / "stand.c3d", markers, labels=labels))
    assert "Plug-in Gait" in {f.value for f in clip.source.findings}
    assert [r.count for r in clip.source.repairs] == [1, 1]
    plain = read_clip(write(tmp_path / "plain.c3d", standing()))
    np.testing.assert_array_equal(clip.positions, plain.positions)
    with pytest.raises(ClipError, match="label is there already"):
        repair(clip, strict=True)


def test_lost_ends_are_cut_off_and_long_gaps_refused(tmp_path):
    markers = standing()
    markers["LANK"][:7] = np.nan
    clip = read_clip(write(tmp_path / "ends.c3d", markers))
    assert clip.frames == FRAMES - 7
    markers["LKNE"][15:30] = np.nan
    with pytest.raises(ClipError, match=r"left_knee.*no data from 0\.15 s to 0\.30 s"):
        read_clip(write(tmp_path / "hole.c3d", markers))


def test_joints_by_their_own_names_need_no_marker_set(tmp_path):
    from clips.readers.markers import joint_centres

    joints, _ = joint_centres(standing())
    clip = read_clip(write(tmp_path / "joints.c3d", joints))
    np.testing.assert_allclose(clip.point("right_elbow"), joints["right_elbow"], atol=1e-6)


def test_unknown_markers_are_refused_with_a_draft(tmp_path):
    markers = {f"M{i}": m for i, m in enumerate(standing().values())}
    with pytest.raises(ClipError, match="no point for left_hip") as refusal:
        read_clip(write(tmp_path / "m.c3d", markers))
    assert refusal.value.option == "mapping"


def test_no_unit_a_wrong_unit_and_no_rate_are_refused(tmp_path):
    path = write(tmp_path / "x.c3d", standing(), unit="furlong")
    with pytest.raises(ClipError, match="POINT:UNITS") as refusal:
        read_clip(path)
    assert (refusal.value.option, refusal.value.suggestion) == ("unit", "mm")
    assert read_clip(path, ReadOptions(unit="mm")).height < 2.0
    with pytest.raises(ClipError, match="m tall, with unit m") as refusal:
        read_clip(path, ReadOptions(unit="m"))
    assert refusal.value.suggestion == "mm"


def test_a_cut_or_broken_file_is_refused(tmp_path):
    path = write(tmp_path / "x.c3d", standing())
    data = path.read_bytes()
    path.write_bytes(data[: len(data) - 4000])
    with pytest.raises(ClipError, match="the file is cut off"):
        read_clip(path)
    path.write_bytes(data[:100])
    with pytest.raises(ClipError, match="100 bytes"):
        read_clip(path)
    path.write_bytes(b"\x00" * 5000)
    with pytest.raises(ClipError, match="a broken C3D"):
        read_clip(path)


def test_a_gait_recording_is_the_manifests(shared):
    clip = read_clip(shared / "c3d" / "btk_gait.c3d")
    found = {f.what: f.value for f in clip.source.findings}
    assert (clip.fps, found["unit"], found["up axis"]) == (100.0, "mm", "z")
    (ends,) = [r for r in clip.source.repairs if "ends" in r.what]
    assert clip.frames + ends.count == 487
    assert 1.5 < clip.height < 1.8
    thigh = np.linalg.norm(clip.point("left_knee") - clip.point("left_hip"), axis=-1)
    assert thigh.std() < 0.01 < thigh.mean()


def test_two_people_in_one_file_are_refused_by_name(tmp_path):
    ana, ben = standing(), {n: m + [1.0, 0.0, 0.0] for n, m in standing().items()}
    del ana["LTOE"]
    both = {f"Ana:{n}": m for n, m in ana.items()} | {f"Ben:{n}": m for n, m in ben.items()}
    with pytest.raises(ClipError, match=r"2 subjects \(Ana, Ben\)"):
        read_clip(write(tmp_path / "two.c3d", both))
    one, two = (read_clip(f"{tmp_path / 'two.c3d'}#{k}") for k in (1, 2))
    assert "left_toe" not in one.landmarks and "left_toe" in two.landmarks
    by_name = read_clip(tmp_path / "two.c3d", ReadOptions(person="Ben"))
    np.testing.assert_array_equal(by_name.positions, two.positions)
    np.testing.assert_allclose(two.point("left_knee")[0] - one.point("left_knee")[0], [1.0, 0.0, 0.0], atol=1e-3)


def test_the_byte_order_of_mips_is_refused_with_a_way_round(tmp_path):
    path = write(tmp_path / "mips.c3d", standing())
    data = bytearray(path.read_bytes())
    data[(data[0] - 1) * 512 + 3] = 86
    path.write_bytes(data)
    with pytest.raises(ClipError, match="MIPS.*save it again in PC order"):
        read_clip(path)


def test_a_lost_toe_costs_the_toe_and_not_the_clip(tmp_path):
    markers = standing()
    markers["LTOE"][10:30] = np.nan
    clip = read_clip(write(tmp_path / "toe.c3d", markers))
    assert clip.frames == FRAMES and "left_toe" not in clip.landmarks and "right_toe" in clip.landmarks
    assert any("left_toe" in r.what for r in clip.source.repairs)


def test_legs_alone_lead_no_robot_and_no_mapping_is_drafted_for_them(tmp_path):
    legs = {n: m for n, m in standing().items() if n[1:] not in ("SHO", "ELB", "WRA", "WRB")}
    with pytest.raises(ClipError, match="markers, none for left_shoulder.*export the other markers") as refused:
        read_clip(write(tmp_path / "legs.c3d", legs))
    assert refused.value.option == ""


def test_a_mapping_for_markers_that_nobody_knows_lists_the_markers(tmp_path):
    """Arms under names of their own: the draft offers the file's labels, not the joints that were computed."""
    markers = standing()
    odd = {n: m for n, m in markers.items() if n[1:] not in ("SHO", "ELB", "WRA", "WRB")}
    odd |= {
        f"{n[0]}odd{n[1:]}{k}": markers[n] for n in markers if n[1:] in ("SHO", "ELB", "WRA", "WRB") for k in range(2)
    }
    with pytest.raises(UnknownSkeletonError) as refused:
        read_clip(write(tmp_path / "odd.c3d", odd))
    assert '#   "LoddSHO0"' in refused.value.draft and '#   "LASI"' in refused.value.draft
