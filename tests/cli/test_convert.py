"""`dance-convert`: what it writes is the motion that it read, where it says it wrote it."""

import numpy as np
import pytest
from conftest import SAMPLES

from cli.convert import main
from clips import ReadOptions, full_qpos, read_clip
from clips.writers import LAYOUTS


@pytest.fixture
def clip(groove_file, tmp_path):
    """The dancer's reference in a folder of the test's own."""
    (tmp_path / "groove.npz").write_bytes(groove_file.read_bytes())
    return tmp_path / "groove.npz"


@pytest.mark.parametrize("layout", LAYOUTS)
def test_a_file_lands_beside_the_clip_under_the_layouts_name_and_reads_back(clip, dancer, capsys, layout):
    out = clip.with_name(f"groove_{layout}{LAYOUTS[layout].suffix}")
    assert main([str(clip), "--to", layout]) == 0
    assert {p.name for p in clip.parent.iterdir()} == {clip.name, out.name}
    said = capsys.readouterr().out
    assert f"wrote {out}" in said and "for dancer" in said
    again = read_clip(out, ReadOptions(fps=LAYOUTS[layout].fps, source_robot="dancer"))
    whole = read_clip(clip)
    assert again.fps == (LAYOUTS[layout].fps or whole.fps)
    duration = [(c.frames - 1) / c.fps for c in (whole, again)]
    assert duration[1] == pytest.approx(duration[0], abs=1 / 30)  # at most a frame is cut at the end
    # First frames are the same instant at every rate; float32 in some layouts.
    np.testing.assert_allclose(full_qpos(again, dancer)[0, 7:], full_qpos(whole, dancer)[0, 7:], atol=1e-6)


def test_through_another_layout_and_back_the_joints_are_the_same(clip, dancer, tmp_path):
    assert main([str(clip), "--to", "isaac-npz", "-o", str(tmp_path / "i.npz")]) == 0
    assert (
        main([str(tmp_path / "i.npz"), "--to", "gmr", "-o", str(tmp_path / "g.pkl"), "--source-robot", "dancer"]) == 0
    )
    again = read_clip(tmp_path / "g.pkl", ReadOptions(source_robot="dancer"))
    np.testing.assert_allclose(
        full_qpos(again, dancer), full_qpos(read_clip(clip), dancer), atol=1e-5
    )  # float32, twice


def test_a_rate_that_is_asked_for_is_written(clip, tmp_path, capsys):
    assert main([str(clip), "--to", "mujoco-npz", "-o", str(tmp_path / "m.npz"), "--out-fps", "25"]) == 0
    assert "at 25 fps" in capsys.readouterr().out and read_clip(tmp_path / "m.npz").fps == 25.0


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ([str(SAMPLES / "groove.bvh"), "--to", "gmr"], "retarget it first: dance-retarget"),
        (["groove.npz", "--to", "fbx"], "unitree-csv, gmr, phc"),
        (["groove.npz", "--to", "unitree-csv", "--out-fps", "50"], "30"),
        (["absent.npz", "--to", "gmr"], "absent.npz"),
        (["groove.npz", "--to", "gmr", "-o", "no/such/folder/a.pkl"], "takes no file"),
    ],
)
def test_what_cannot_be_written_is_refused_and_leaves_nothing(clip, monkeypatch, capsys, words, said):
    monkeypatch.chdir(clip.parent)
    assert main(words) == 2
    assert said in capsys.readouterr().err
    assert [p.name for p in clip.parent.iterdir()] == [clip.name]
    assert not (SAMPLES / "groove_gmr.pkl").exists()
