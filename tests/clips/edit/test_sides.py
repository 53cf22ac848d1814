"""Left and right exchanged for a while are exchanged back; in every frame, they are refused with a mapping that cures it."""

from dataclasses import replace

import numpy as np
import pytest
from conftest import SAMPLES
from damage import exchanged, read_shared

from clips import ClipError, read_clip, repair
from clips.edit import cut, exchanged_everywhere
from clips.edit.sides import with_sides_unchanged
from clips.identify.mapping import ExchangedSidesError

CLIPS = [
    "bvh/bandai1_dance_short_normal_001.bvh", "bvh/perfume_aachan.bvh", "amc/cmu_charleston1.amc", "c3d/btk_gait.c3d",
    "npz/asap_smpl_apt_level1.npz",
]  # fmt: skip
PARTS = [
    ("ankle", "toe"), ("wrist",), ("elbow", "wrist"), ("knee", "ankle", "toe"), ("hip", "knee", "ankle", "toe"),
    ("shoulder", "elbow", "wrist"), ("hip", "knee", "ankle", "toe", "shoulder", "elbow", "wrist"),
]  # fmt: skip


@pytest.fixture(scope="module", params=CLIPS)
def clip(request, shared):
    whole = repair(read_shared(shared, request.param))
    return replace(cut(whole, 0.0, min(8.0, (whole.frames - 1) / whole.fps)), orientations=None)


def there(clip, parts):
    return [p for p in parts if f"left_{p}" in clip.landmarks]


@pytest.mark.parametrize("seconds", [0.0, 0.1, 1.5])
@pytest.mark.parametrize("parts", PARTS, ids="-".join)
def test_sides_that_flip_for_a_while_are_flipped_back(clip, parts, seconds):
    length = min(max(1, round(seconds * clip.fps)), round(0.4 * clip.frames))
    first = clip.frames // 3
    mended = repair(exchanged(clip, there(clip, parts), slice(first, first + length)))
    np.testing.assert_array_equal(mended.positions, clip.positions)
    told = [r for r in mended.source.repairs if "exchanged back" in r.what]
    assert {r.count for r in told} == {length} and len(told) == len(there(clip, parts))


def test_sides_that_flip_again_and_again_are_flipped_back(clip):
    at = np.zeros(clip.frames, dtype=bool)
    for k, first in enumerate(range(10, clip.frames - 20, max(25, clip.frames // 6))):
        at[first : first + 1 + 3 * k] = True
    mended = repair(exchanged(clip, ["wrist"], at))
    np.testing.assert_array_equal(mended.positions, clip.positions)


def test_a_sound_clip_keeps_its_sides(clip):
    assert repair(clip) is clip
    assert not exchanged_everywhere(clip)


def test_hands_that_cross_and_clap_are_no_exchange():
    """Wrists pass through each other at 6 m/s: they leap to each other's place, but the forearms say whose they are."""
    dance = read_clip(SAMPLES / "groove.bvh")
    t = np.arange(dance.frames) / dance.fps
    swing = 0.4 * np.sin(2.0 * np.pi * 2.0 * t)
    positions = dance.positions.copy()
    middle = 0.5 * (dance.point("left_shoulder") + dance.point("right_shoulder"))
    across = dance.point("left_shoulder") - dance.point("right_shoulder")
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    for side, sign in (("left", 1.0), ("right", -1.0)):
        hand = middle + sign * swing[:, None] * across - [0.0, 0.0, 0.3]
        shoulder = dance.point(f"{side}_shoulder")
        positions[:, dance.names.index(dance.landmarks[f"{side}_wrist"])] = hand
        positions[:, dance.names.index(dance.landmarks[f"{side}_elbow"])] = 0.5 * (hand + shoulder)
    clip = replace(dance, positions=positions, orientations=None)
    assert with_sides_unchanged(clip) is clip


@pytest.mark.parametrize("parts", PARTS[:-1], ids="-".join)
def test_sides_exchanged_in_every_frame_are_named(clip, parts):
    assert exchanged_everywhere(exchanged(clip, there(clip, parts), slice(None))) == there(clip, parts)


def test_a_toe_of_one_side_is_left_where_it_is():
    dance = read_clip(SAMPLES / "groove.bvh")
    one = {k: name for k, name in dance.landmarks.items() if k != "right_toe"}
    turned = exchanged(replace(dance, landmarks=one, orientations=None), ["hip", "knee", "ankle"], slice(None))
    assert exchanged_everywhere(turned) == ["hip", "knee", "ankle"]


@pytest.mark.parametrize("parts", [("Ankle", "Toe"), ("Wrist",), ("Hip", "Knee", "Ankle", "Toe")], ids="-".join)
def test_a_file_with_exchanged_names_is_refused_with_a_mapping_that_cures_it(tmp_path, parts):
    text = (SAMPLES / "groove.csv").read_text()
    lines = text.splitlines()
    head = next(i for i, line in enumerate(lines) if not line.startswith("#"))
    swapped = lines[head]
    for part in (p.lower() for p in parts):
        swapped = (
            swapped.replace(f"left_{part}_", "@")
            .replace(f"right_{part}_", f"left_{part}_")
            .replace("@", f"right_{part}_")
        )
    assert swapped != lines[head]
    path = tmp_path / "swapped.csv"
    path.write_text("\n".join([*lines[:head], swapped, *lines[head + 1 :]]))
    with pytest.raises(ExchangedSidesError, match="on each other's side in every frame") as refused:
        read_clip(path)
    (tmp_path / "cure.toml").write_text(refused.value.draft)
    from clips import ReadOptions

    cured = read_clip(path, ReadOptions(mapping=str(tmp_path / "cure.toml")))
    honest = read_clip(SAMPLES / "groove.csv")
    for landmark in honest.landmarks:
        np.testing.assert_array_equal(cured.point(landmark), honest.point(landmark))


def test_a_whole_body_exchanged_is_a_mirrored_file(tmp_path):
    lines = (SAMPLES / "groove.csv").read_text().splitlines()
    head = next(i for i, line in enumerate(lines) if not line.startswith("#"))
    swapped = lines[head].replace("left_", "@").replace("right_", "left_").replace("@", "right_")
    (tmp_path / "mirrored.csv").write_text("\n".join([*lines[:head], swapped, *lines[head + 1 :]]))
    with pytest.raises(ClipError, match="left and right are swapped, or the file is mirrored"):
        read_clip(tmp_path / "mirrored.csv")
