"""Other tools' motions as they stand: judged, compared, and taken where a reference is asked for."""

import json

import numpy as np
import pytest
from conftest import SAMPLES

import cli.compare
import cli.report
from clips import ClipError, is_reference, load_reference, read_clip, save_reference
from clips.writers import LAYOUTS, write_motion
from retarget import as_it_stands, limb_angles, retarget
from robot_models import load_robot


@pytest.fixture(scope="module")
def result(dancer):
    from clips import cut
    from retarget import RetargetConfig

    return retarget(
        cut(read_clip(SAMPLES / "groove.bvh"), 0.0, 3.0), dancer, RetargetConfig(lead_in_s=0.0, lead_out_s=0.0)
    )


@pytest.fixture
def files(result, tmp_path, dancer):
    """One motion in our form and in every other."""
    save_reference(result.reference, tmp_path / "ours.npz")
    clip, out = read_clip(tmp_path / "ours.npz"), [tmp_path / "ours.npz"]
    for name, layout in LAYOUTS.items():
        if name != "unitree-csv":  # it is written at 30 frames per second
            out.append(tmp_path / f"{name}{layout.suffix}")
            write_motion(out[-1], name, clip, dancer)
    return out


def test_a_motion_is_judged_alike_in_every_layout_and_no_frame_of_it_is_touched(files, result, dancer, tmp_path):
    assert cli.report.main([*map(str, files), "--source-robot", "dancer", "--json", str(tmp_path / "r.json")]) == 0
    reports = json.loads((tmp_path / "r.json").read_text())["reports"]
    first = {key: told["value"] for key, told in reports["ours.npz"].items()}
    for name, report in reports.items():
        for key, told in report.items():
            assert told["value"] == pytest.approx(first[key], rel=0.02, abs=0.05), (name, key)
    stands = as_it_stands(read_clip(files[0]), dancer)
    np.testing.assert_allclose(stands.reference.qpos, result.reference.qpos, atol=1e-9)
    assert stands.targets is None and stands.reference.meta["as_it_stands"]


def test_what_is_bad_is_called_bad_and_its_motion_is_not_its_excuse(result, dancer, tmp_path, capsys):
    from standing import reference_of

    qpos = result.reference.qpos.copy()
    qpos[60:70, 2] -= 0.04
    save_reference(reference_of(dancer, qpos), tmp_path / "sunk.npz")
    assert cli.report.main([str(tmp_path / "sunk.npz")]) == 1
    said = capsys.readouterr().out
    assert "under the floor" in said and "recording" not in said.split("next:")[0]


def test_a_person_is_no_robots_motion(capsys):
    assert cli.report.main([str(SAMPLES / "groove.bvh")]) == 2
    assert f"dance-retarget {SAMPLES / 'groove.bvh'}" in capsys.readouterr().err


def test_the_library_refuses_a_person_and_another_robots_motion(result, dancer):
    with pytest.raises(ClipError, match="a person"):
        as_it_stands(read_clip(SAMPLES / "groove.bvh"), dancer)


def test_two_motions_are_as_far_apart_as_they_were_bent(result, dancer, tmp_path):
    bent = result.reference.qpos.copy()
    bent[:, 7 + dancer.joint("left_elbow")] -= 0.2
    from standing import reference_of

    apart = limb_angles(result.reference, dancer, reference_of(dancer, bent), dancer)
    elbow = apart.pop("left elbow to left wrist")
    assert np.degrees(0.2) == pytest.approx(elbow.mean(), rel=0.05)
    assert max(a.max() for a in apart.values()) < 1e-4


def test_where_a_motion_heads_and_which_robot_it_is_do_not_count(result, dancer):
    from standing import reference_of

    from robot_models.maths import rotation as rot

    turned = result.reference.qpos.copy()
    turn = rot.from_yaw(np.array(1.3))
    turned[:, :3] = rot.rotate(np.broadcast_to(turn, (len(turned), 4)), turned[:, :3])
    turned[:, 3:7] = rot.multiply(np.broadcast_to(turn, (len(turned), 4)), turned[:, 3:7])
    apart = limb_angles(result.reference, dancer, reference_of(dancer, turned), dancer)
    assert max(a.max() for a in apart.values()) < 1e-4
    g1 = load_robot("g1")
    from clips import cut

    other = retarget(cut(read_clip(SAMPLES / "groove.bvh"), 0.0, 3.0), g1)
    assert np.mean([a.mean() for a in limb_angles(result.reference, dancer, other.reference, g1).values()]) < 8.0


def test_a_comparison_shows_both_with_their_contacts(files, tmp_path, capsys):
    words = [
        str(files[0]),
        str(tmp_path / "gmr.pkl"),
        "--source-robot",
        "dancer",
        "--recording",
        str(tmp_path / "b.rrd"),
    ]
    assert cli.compare.main(words) == 0
    assert "limbs of gmr.pkl 0.0 deg off those of ours.npz" in capsys.readouterr().out
    data = (tmp_path / "b.rrd").read_bytes()
    assert b"contacts/ours-npz/left_heel" in data and b"contacts/gmr-pkl/right_toe" in data
    assert cli.compare.main([str(files[0])]) == 2


def test_references_are_known_by_what_they_hold(files):
    assert [is_reference(path) for path in files] == [True] + [False] * (len(files) - 1)
    assert not is_reference(SAMPLES / "groove.bvh") and not is_reference(SAMPLES / "none.npz")


def test_training_takes_another_tools_motion_as_it_stands_and_says_so(files, tmp_path, monkeypatch, capsys):
    pytest.importorskip("torch")
    import cli.train

    monkeypatch.chdir(tmp_path)
    words = ["--ref", "gmr.pkl", "--source-robot", "dancer", "--check-ref"]
    assert cli.train.main(words) in (0, 1)
    assert "gmr.pkl as it stands: GMR pickle, 3.0 s for dancer" in capsys.readouterr().out
    written = load_reference(tmp_path / "gmr_dancer_as_it_stands.npz", load_robot("dancer"))
    assert written.joint_torque is not None and written.meta["as_it_stands"]
