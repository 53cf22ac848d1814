"""Real files that nobody in this project made: what the readers recognise is what their makers say of them."""

import csv
import re

import numpy as np
import pytest

from clips import HumanClip, ReadOptions, cut, full_qpos, read_clip
from robot_models import load_robot
from robot_models.maths import rotation as rot

RATES = {
    "csv/g1_gangnam_style_60hz.csv": 60.0,
    "csv/g1moves_tiktok.csv": 60.0,
    "csv/lafan1_g1_dance1_subject2.csv": 30.0,
    "amc/cmu_charleston1.amc": 120.0,
    "amc/cmu_lambada.amc": 120.0,
}
FILES = [
    "csv/g1_gangnam_style_60hz.csv", "csv/g1moves_tiktok.csv", "csv/lafan1_g1_dance1_subject2.csv",
    "bvh/lafan1_dance1_subject2.bvh", "bvh/bandai1_dance_short_normal_001.bvh", "bvh/perfume_aachan.bvh",
    "bvh/rokoko_jesse_dance.bvh", "bvh/fair1_dab.bvh", "bvh/cmu_12_01_walk.bvh",
    "pkl/pbhc_charleston_dance.pkl", "pkl/gmt_dance.pkl", "pkl/twist2_yanjie_walk_001.pkl", "pkl/asap_apt_level1.pkl",
    "pkl/mimickit_g1_walk.pkl", "npz/asap_smpl_apt_level1.npz", "npz/amp_G1_dance.npz", "npz/g1moves_tiktok.npz",
    "amc/cmu_charleston1.amc", "amc/cmu_lambada.amc", "deepmimic/humanoid3d_dance_a.txt", "deepmimic/humanoid3d_dance_b.txt",
]  # fmt: skip


def read(shared, file):
    return read_clip(shared / file, ReadOptions(fps=RATES.get(file)))


@pytest.mark.parametrize("file", FILES)
def test_frames_rate_units_and_orders_are_those_of_the_manifest(shared, file):
    rows = csv.DictReader((shared / "manifest.csv").read_text().splitlines())
    row = next(r for r in rows if r["file"] == file)
    clip = read(shared, file)
    assert clip.frames == int(row["frames"])
    assert clip.fps == pytest.approx(float(row["fps"].split()[0]), rel=1e-3)
    found = {f.what: f.value for f in clip.source.findings}
    if isinstance(clip, HumanClip):
        assert found["up axis"] == row["up_axis"].lower()
        unit = {"cm": "cm", "m": "m", "1 u": "cmu"}.get(row["units"].split(",")[0][:3].strip())
        if unit:
            assert found["unit"] == unit
        assert 1.4 < clip.height < 1.95
    elif row["rotation"] in ("xyzw", "wxyz"):
        assert found["quaternion order"] == row["rotation"]


def rows_of_the_readme(shared):
    """file -> cells of the table "What is in each file", for the files that are stored."""
    lines = [line for line in (shared / "README.md").read_text().splitlines() if line.startswith("| `")]
    cells = [[c.strip() for c in line.strip("|").split(" | ")] for line in lines]
    head = ("file", "fps", "frames", "s", "units", "up", "rotation", "skeleton")
    return {c[0].strip("`"): dict(zip(head, c, strict=False)) for c in cells if len(c) == 9}


@pytest.mark.parametrize("file", [*FILES, "c3d/btk_gait.c3d"])
def test_inspection_prints_the_conventions_that_the_readme_states(shared, file, capsys):
    from cli.inspect import main

    row = rows_of_the_readme(shared)[file]
    told_elsewhere = "(in file)" not in row["fps"] and file in RATES
    assert main([str(shared / file), *(["--fps", row["fps"].split()[0]] if told_elsewhere else [])]) == 0
    said = capsys.readouterr().out.partition("\ncheck ")[0]  # the checks' table below is not of the file's own words
    lines = {line[:18].strip(): line[18:].strip() for line in said.splitlines() if line[:1].strip()}
    left_out = sum(int(n) for n in re.findall(r"frames left out[^:]*: (\d+) frames", said))
    assert int(lines["length"].split()[0]) + left_out == int(row["frames"])
    assert float(lines["fps"]) == pytest.approx(float(row["fps"].split()[0]), rel=1e-3)
    assert lines["up axis"] == row["up"].lower()
    unit = {"m, rad": ("m, rad", "m"), "cm, deg": ("cm",), "mm": ("mm",)}.get(row["units"])
    if unit:
        assert lines["unit"] in unit
    elif "5.64" in row["units"] or "0.45" in row["units"]:
        assert lines["unit"] == "cmu"
    else:  # FAIR's own unit: no custom, so a stature is assumed and said to be
        assert float(lines["unit"].split()[0]) == pytest.approx(0.039, rel=0.1)
        assert "assumed" in said and "--stature" in said
    if row["rotation"].startswith(("xyzw", "wxyz")) and "G1" in row["skeleton"]:
        assert lines["quaternion order"] == row["rotation"][:4]
    if file.startswith("bvh") and "as above" not in row["rotation"]:
        orders = re.findall(r"[XYZ]{3}|[XYZ]rot [XYZ]rot [XYZ]rot", row["rotation"])
        assert {o.replace("rot", "").replace(" ", "") for o in orders} <= set(lines["Euler order"].split(", "))


def test_one_dance_in_five_files_is_one_dance(shared):
    truth = full_qpos(read(shared, "csv/lafan1_g1_dance1_subject2.csv"), load_robot("g1"))
    no_wrists = [i for i, j in enumerate(load_robot("g1").joint_names) if "wrist" not in j]
    gmt = full_qpos(read(shared, "pkl/gmt_dance.pkl"), load_robot("g1"))
    np.testing.assert_allclose(gmt[:, 7:][:, no_wrists], truth[: len(gmt), 7:][:, no_wrists], atol=1e-6)
    pbhc = full_qpos(read(shared, "pkl/pbhc_charleston_dance.pkl"), load_robot("g1"))
    np.testing.assert_allclose(pbhc[30:580, 7:][:, no_wrists], truth[150:700, 7:][:, no_wrists], atol=1e-6)
    amp = full_qpos(read(shared, "npz/amp_G1_dance.npz"), load_robot("g1"))[::2]
    start = min(range(200, 300), key=lambda k: np.abs(truth[k : k + 300, 7:] - amp[:300, 7:]).mean())
    assert np.abs(truth[start : start + 300, 7:] - amp[:300, 7:]).mean() < 0.02


def test_the_dancer_and_the_robot_of_one_dance_walk_one_path(shared):
    """The BVH is whom the other four were made from: another body, one heading and one path, but for turn and size."""
    person, robot = read(shared, "bvh/lafan1_dance1_subject2.bvh"), read(shared, "csv/lafan1_g1_dance1_subject2.csv")
    left = person.point("left_hip") - person.point("right_hip")
    off = np.unwrap(np.arctan2(-left[:, 0], left[:, 1])) - np.unwrap(rot.yaw(robot.root_quat))
    assert np.percentile(np.abs(off - np.median(off)), 95) < np.radians(10)
    turn = rot.from_yaw(np.array(-np.median(off)))
    a = rot.rotate(np.broadcast_to(turn, (person.frames, 4)), person.point("pelvis"))[:, :2]
    a, b = a - a.mean(axis=0), robot.root_pos[:, :2] - robot.root_pos[:, :2].mean(axis=0)
    size = (a * b).sum() / (a * a).sum()
    assert 0.6 < size < 0.9 and np.abs(size * a - b).max() < 0.04  # of a path of 3.4 by 4.5 m
    assert np.corrcoef(person.point("pelvis")[:, 2], robot.root_pos[:, 2])[0, 1] > 0.97


def test_the_tiktok_csv_and_npz_are_one_dance(shared):
    a = full_qpos(read(shared, "csv/g1moves_tiktok.csv"), load_robot("g1"))
    b = full_qpos(read(shared, "npz/g1moves_tiktok.npz"), load_robot("g1"))
    np.testing.assert_allclose(a[: len(b)], b, atol=0.15)


@pytest.mark.slow
@pytest.mark.parametrize("file", FILES)
def test_every_clip_reaches_the_dancer_inside_its_position_limits(shared, file):
    from retarget import retarget

    robot = load_robot("dancer")
    result = retarget(cut(read(shared, file), 0.0, 8.0), robot)
    assert (result.reference.joint_pos >= robot.lower).all() and (result.reference.joint_pos <= robot.upper).all()
    shares = [m for m in result.report.metrics if m.key.startswith("joint") and m.limit is not None]
    assert len(shares) == 3 and all(m.passed for m in shares), shares
