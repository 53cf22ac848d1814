"""AMC on its ASF, and DeepMimic's txt: against kinematics by matrices, and against what is known of real clips."""

import json

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from clips import ReadOptions, read_clip
from clips.errors import ClipError

BONES = """lhipjoint 0.6 -0.7 0.3 2.0 0 0 0 -
lfemur 0.34 -0.94 0.0 7.5 0 0 20 rx,ry,rz
ltibia 0.34 -0.94 0.1 7.6 10 0 20 rx
lfoot 0.1 -0.2 0.97 2.2 -90 5 20 rx,rz
ltoes 0.0 -0.1 1.0 1.0 -90 0 20 rx
rhipjoint -0.6 -0.7 0.3 2.0 0 0 0 -
rfemur -0.34 -0.94 0.0 7.5 0 0 -20 rx,ry,rz
rtibia -0.34 -0.94 0.1 7.6 10 0 -20 rx
rfoot -0.1 -0.2 0.97 2.2 -90 5 -20 rx,rz
rtoes 0.0 -0.1 1.0 1.0 -90 0 -20 rx
thorax 0.0 1.0 0.0 7.0 0 0 0 rx,ry,rz
lhumerus 1.0 0.1 0.0 5.0 180 30 -90 rx,ry,rz
lradius 1.0 0.0 0.0 3.5 180 30 -90 rx
lwrist 1.0 0.0 0.0 1.0 180 30 -90 ry
rhumerus -1.0 0.1 0.0 5.0 180 -30 90 rx,ry,rz
rradius -1.0 0.0 0.0 3.5 180 -30 90 rx
rwrist -1.0 0.0 0.0 1.0 180 -30 90 ry"""
TREE = """root lhipjoint rhipjoint thorax
lhipjoint lfemur
lfemur ltibia
ltibia lfoot
lfoot ltoes
rhipjoint rfemur
rfemur rtibia
rtibia rfoot
rfoot rtoes
thorax lhumerus rhumerus
lhumerus lradius
lradius lwrist
rhumerus rradius
rradius rwrist"""


def skeleton(path):
    blocks = []
    for line in BONES.splitlines():
        name, x, y, z, length, a, b, c, dof = line.split()
        moving = "" if dof == "-" else f"  dof {dof.replace(',', ' ')}\n"
        blocks.append(
            f"begin\n  id 1\n  name {name}\n  direction {x} {y} {z}\n  length {length}\n  axis {a} {b} {c} XYZ\n{moving}end"
        )
    path.write_text(
        ":version 1.10\n:units\n mass 1\n length 0.45\n angle deg\n:root\n order TX TY TZ RX RY RZ\n axis XYZ\n"
        " position 0 0 0\n orientation 0 0 0\n:bonedata\n" + "\n".join(blocks) + f"\n:hierarchy\nbegin\n{TREE}\nend\n"
    )


def motion(path, rng, frames=12, skip=None):
    values = []
    lines = ["#!OML:ASF made", ":FULLY-SPECIFIED", ":DEGREES"]
    for t in range(frames):
        row = {"root": np.array([1.0 + 0.01 * t, 17.0, -2.0, *(5.0 * rng.normal(size=3))])}
        for line in BONES.splitlines():
            name, *_, dof = line.split()
            if dof != "-":
                row[name] = 4.0 * rng.normal(size=dof.count(",") + 1)
        values.append(row)
        lines += [str(t + 1 + (skip is not None and t >= skip))]
        lines += [f"{name} {' '.join(f'{v:.17g}' for v in told)}" for name, told in row.items()]
    path.write_text("\n".join(lines) + "\n")
    return values


def by_matrices(row):
    """Starts of the bones in the file's unit: R = C M C^-1, extrinsic angles in the order of the letters."""
    parents = {child: line.split()[0] for line in TREE.splitlines() for child in line.split()[1:]}
    turns = {"root": Rotation.from_euler("xyz", row["root"][3:], degrees=True)}
    starts, ends = {"root": row["root"][:3]}, {"root": row["root"][:3]}
    for line in BONES.splitlines():
        name, *numbers, dof = line.split()
        x, y, z, length, *axis = map(float, numbers)
        frame = Rotation.from_euler("xyz", axis, degrees=True)
        told = np.zeros(3)
        for letter, value in zip(dof.split(",") if dof != "-" else (), row.get(name, ()), strict=True):
            told["xyz".index(letter[1])] = value
        turns[name] = turns[parents[name]] * frame * Rotation.from_euler("xyz", told, degrees=True) * frame.inv()
        starts[name] = ends[parents[name]]
        along = np.array([x, y, z])
        ends[name] = starts[name] + turns[name].apply(length * along / np.linalg.norm(along))
    return starts


def test_amc_is_forward_kinematics_by_matrices(tmp_path, rng):
    skeleton(tmp_path / "12.asf")
    values = motion(tmp_path / "12_01.amc", rng)
    clip = read_clip(tmp_path / "12_01.amc", ReadOptions(fps=120.0))
    assert clip.fps == 120.0 and clip.frames == 12
    assert any(f.what == "unit" and f.value == "cmu" for f in clip.source.findings)
    for t, row in enumerate(values):
        for name, start in by_matrices(row).items():
            x, y, z = start * 0.0254 / 0.45
            np.testing.assert_allclose(clip.positions[t, clip.names.index(name)], (x, -z, y), atol=1e-9)


def test_an_amc_without_a_rate_a_skeleton_or_with_two_is_refused_with_the_line_to_type(tmp_path, rng):
    motion(tmp_path / "dance.amc", rng)
    with pytest.raises(ClipError, match="no ASF"):
        read_clip(tmp_path / "dance.amc", ReadOptions(fps=120.0))
    skeleton(tmp_path / "one.asf")
    with pytest.raises(ClipError, match="no frame rate"):
        read_clip(tmp_path / "dance.amc")
    assert read_clip(tmp_path / "dance.amc", ReadOptions(fps=120.0)).frames == 12  # the only one there
    skeleton(tmp_path / "two.asf")
    with pytest.raises(ClipError, match="2 ASF") as caught:
        read_clip(tmp_path / "dance.amc", ReadOptions(fps=120.0))
    assert caught.value.option == "skeleton"
    named = ReadOptions(fps=120.0, skeleton=str(tmp_path / "two.asf"))
    assert read_clip(tmp_path / "dance.amc", named).frames == 12


def test_an_amc_of_another_skeleton_or_with_a_gap_is_refused(tmp_path, rng):
    skeleton(tmp_path / "a.asf")
    motion(tmp_path / "a_1.amc", rng, skip=5)
    with pytest.raises(ClipError, match="frame 7 after 5"):
        read_clip(tmp_path / "a_1.amc", ReadOptions(fps=120.0))
    motion(tmp_path / "a_2.amc", rng)
    text = (tmp_path / "a_2.amc").read_text().replace("thorax", "tail")
    (tmp_path / "a_2.amc").write_text(text)
    with pytest.raises(ClipError, match="is this its skeleton"):
        read_clip(tmp_path / "a_2.amc", ReadOptions(fps=120.0))
    (tmp_path / "a_3.amc").write_text(text.replace("tail", "thorax")[:-200])
    with pytest.raises(ClipError, match="the same bones|one number"):
        read_clip(tmp_path / "a_3.amc", ReadOptions(fps=120.0))


def test_an_asf_alone_is_refused_with_the_way_round(tmp_path):
    skeleton(tmp_path / "a.asf")
    (tmp_path / "a.asf").write_text("#!OML:ASF\n" + (tmp_path / "a.asf").read_text())
    with pytest.raises(ClipError, match="no reader knows|give the AMC"):
        read_clip(tmp_path / "a.asf")


def deepmimic(path, rows, **more):
    path.write_text(json.dumps({"Loop": "wrap", "Frames": rows, **more}))


def rest(frames=5, dt=1 / 60):
    row = np.zeros(44)
    row[0], row[2] = dt, 0.87
    for at in (4, 8, 12, 16, 21, 25, 30, 35, 39):
        row[at] = 1.0
    rows = np.tile(row, (frames, 1))
    rows[:, [20, 34]] = -0.3  # knees bend about z
    rows[-1, 0] = 0.0
    return rows


def test_deepmimics_columns_are_its_joints(tmp_path):
    rows = rest()
    rows[:, 25:29] = Rotation.from_euler("x", 90, degrees=True).as_quat(scalar_first=True)  # right shoulder
    rows[:, 29] = 0.5 * np.pi  # right elbow
    deepmimic(tmp_path / "m.txt", rows.tolist())
    clip = read_clip(tmp_path / "m.txt")
    assert clip.fps == 60.0

    def at(name):
        return clip.positions[0, clip.names.index(name)]

    # y up becomes z up, z (the right side) becomes -y: left is +y.
    assert at("left_hip")[1] > 0 > at("right_hip")[1]
    np.testing.assert_allclose(at("right_elbow") - at("right_shoulder"), (0, 0.274788, 0), atol=1e-6)  # inwards
    np.testing.assert_allclose(at("right_wrist") - at("right_elbow"), (0.258947, 0, 0), atol=1e-6)  # forward
    knee = np.array([np.sin(0.3), 0, -np.cos(0.3)]) * 0.409870
    np.testing.assert_allclose(at("left_ankle") - at("left_knee"), (-knee[0], 0, knee[2]), atol=1e-6)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda r: r[:, :40], "44 columns"),
        (lambda r: np.where(np.arange(44) == 8, 0.1, r), "chest.*off unit length"),
        (
            lambda r: r * np.where(np.arange(44) == 0, np.linspace(1, 9, len(r))[:, None], 1.0),
            "durations that are alike",
        ),
        (lambda r: np.where(np.arange(44) == 20, np.nan, r), "not finite"),
    ],
)
def test_a_deepmimic_file_that_is_not_one_is_refused(tmp_path, change, said):
    deepmimic(tmp_path / "m.txt", change(rest()).tolist())
    with pytest.raises(ClipError, match=said):
        read_clip(tmp_path / "m.txt")


@pytest.mark.parametrize(("name", "low", "high"), [("cmu_charleston1", 0.95, 1.05), ("cmu_lambada", 0.93, 1.01)])
def test_cmus_dancers_stand_as_high_as_is_known(shared, name, low, high):
    clip = read_clip(shared / "amc" / f"{name}.amc", ReadOptions(fps=120.0))
    root = clip.positions[:, 0, 2]
    assert root.min() == pytest.approx(low, abs=0.005) and root.max() == pytest.approx(high, abs=0.005)
    assert 0.0 < clip.positions[..., 2].min() < 0.06


@pytest.mark.parametrize(("name", "low", "high"), [("a", 0.748, 0.941), ("b", 0.762, 0.947)])
def test_deepmimics_dancers_stand_as_high_as_is_known(shared, name, low, high):
    clip = read_clip(shared / "deepmimic" / f"humanoid3d_dance_{name}.txt")
    root = clip.positions[:, 0, 2]
    assert (
        clip.fps == 60.0 and root.min() == pytest.approx(low, abs=1e-3) and root.max() == pytest.approx(high, abs=1e-3)
    )
    feet = [clip.positions[:, clip.names.index(f"{s}_toe"), 2].min() for s in ("left", "right")]
    assert -0.05 < min(feet) < 0.08


def test_frames_of_unequal_durations_come_to_one_rate(tmp_path):
    rows = rest(40)
    rows[:-1, 0] = np.tile([1 / 60, 1 / 60, 2 / 60], 13)
    at = np.concatenate(([0.0], np.cumsum(rows[:-1, 0])))
    rows[:, 1] = 0.5 * at  # walks along x at half a metre a second
    deepmimic(tmp_path / "m.txt", rows.tolist())
    clip = read_clip(tmp_path / "m.txt")
    assert clip.fps == 60.0 and clip.frames == round(at[-1] * 60) + 1
    way = np.linalg.norm(clip.point("pelvis") - clip.point("pelvis")[0], axis=1)
    np.testing.assert_allclose(way, 0.5 * np.arange(clip.frames) / 60.0, atol=1e-9)
    assert any("brought to one rate" in f.why for f in clip.source.findings)
