"""Skeletons whose names tell nothing: a draft is written, the run stops, and the confirmed mapping reads the clip."""

import re
import tomllib

import numpy as np
import pytest
from conftest import SAMPLES

from clips import ClipError, ReadOptions, read_clip
from clips.identify.landmark_geometry import estimate_landmarks
from clips.identify.mapping import UnknownSkeletonError


@pytest.fixture
def nameless(tmp_path):
    """The sample with joints called J0, J1 ... and its true landmarks under those names."""
    text = (SAMPLES / "groove.bvh").read_text()
    names = re.findall(r"(?:ROOT|JOINT) (\S+)", text)
    for i, name in enumerate(names):
        text = re.sub(rf"(ROOT|JOINT) {name}\b", rf"\1 J{i}", text)
    path = tmp_path / "stranger.bvh"
    path.write_text(text)
    clip = read_clip(SAMPLES / "groove.bvh")
    return path, {k: f"J{names.index(v)}" for k, v in clip.landmarks.items()}


def test_an_unknown_skeleton_is_refused_with_a_draft_that_geometry_gets_right(nameless):
    path, truth = nameless
    with pytest.raises(UnknownSkeletonError, match="no point for left_hip") as refusal:
        read_clip(path)
    drafted = tomllib.loads(refusal.value.draft)["landmarks"]
    assert {k: v for k, v in drafted.items() if v} == truth


def test_the_confirmed_mapping_reads_the_clip_as_the_names_would(nameless, tmp_path):
    path, _ = nameless
    with pytest.raises(UnknownSkeletonError) as refusal:
        read_clip(path)
    mapping = tmp_path / refusal.value.suggestion
    mapping.write_text(refusal.value.draft)
    mapped, named = read_clip(path, ReadOptions(mapping=str(mapping))), read_clip(SAMPLES / "groove.bvh")
    for landmark in named.landmarks:
        np.testing.assert_array_equal(mapped.point(landmark), named.point(landmark))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (('left_hip = "J', 'left_hop = "J'), "left_hop.*did you mean 'left_hip'"),
        (('left_hip = "J', 'left_hip = "K'), "left_hip: found 'K"),
        (('left_hip = "J', 'left_hip = "J0" # "J'), "for two parts of the body"),
        (("[landmarks]", "[marks]"), r"no table \[landmarks\]"),
        (('right_wrist = "', 'right_wrist = 5 # "'), r"no table \[landmarks\] of names"),
        (("[landmarks]", "[landmarks"), "cannot be read"),
    ],
)
def test_a_broken_mapping_is_refused_with_its_line(nameless, tmp_path, change, message):
    path, _ = nameless
    with pytest.raises(UnknownSkeletonError) as refusal:
        read_clip(path)
    (tmp_path / "m.toml").write_text(refusal.value.draft.replace(*change))
    with pytest.raises(ClipError, match=message):
        read_clip(path, ReadOptions(mapping=str(tmp_path / "m.toml")))


def test_an_unfinished_or_absent_mapping_is_refused(nameless, tmp_path):
    path, _ = nameless
    (tmp_path / "m.toml").write_text('[landmarks]\nleft_hip = "J1"\n')
    with pytest.raises(ClipError, match="no point for left_knee"):
        read_clip(path, ReadOptions(mapping=str(tmp_path / "m.toml")))
    with pytest.raises(ClipError, match="no such file"):
        read_clip(path, ReadOptions(mapping=str(tmp_path / "absent.toml")))


def test_points_without_a_hierarchy_are_drafted_by_name_only(tmp_path, rng):
    names = [f"marker {i}" for i in range(8)]
    head = ",".join(f"{n}_{a}" for n in names for a in "xyz")
    rows = [",".join(f"{x:.4f}" for x in row) for row in rng.uniform(0, 1, size=(5, 24))]
    (tmp_path / "cloud.csv").write_text("\n".join(["# fps: 30", head, *rows]))
    with pytest.raises(UnknownSkeletonError) as refusal:
        read_clip(tmp_path / "cloud.csv")
    assert set(tomllib.loads(refusal.value.draft)["landmarks"].values()) == {""}


def test_the_command_writes_the_draft_once_and_says_how_to_go_on(nameless, tmp_path, monkeypatch, capsys):
    from cli.retarget import main

    path, _ = nameless
    monkeypatch.chdir(tmp_path)
    assert main([str(path)]) == 2
    said = capsys.readouterr().err
    assert "wrote stranger.mapping.toml" in said and "--mapping stranger.mapping.toml" in said
    assert not list(tmp_path.glob("*.npz"))
    (tmp_path / "stranger.mapping.toml").write_text("# mine\n")
    assert main([str(path)]) == 2
    assert "left as it is" in capsys.readouterr().err.replace("was left as it is", "left as it is")
    assert (tmp_path / "stranger.mapping.toml").read_text() == "# mine\n"


@pytest.mark.parametrize(
    "file", ["lafan1_dance1_subject2", "bandai1_dance_short_normal_001", "perfume_aachan", "fair1_dab"]
)
def test_geometry_finds_what_names_tell_on_real_skeletons(shared, file):
    clip = read_clip(shared / "bvh" / f"{file}.bvh")
    assert estimate_landmarks(clip.names, clip.parents, clip.positions) == dict(clip.landmarks)
