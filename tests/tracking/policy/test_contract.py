"""Contracts: a file holds all of one to the last bit, and what cannot be one is refused by the key that is wrong."""

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

import tracking
from tracking import TrackingError, read_contract
from tracking.policy.contract import FROM_DEFAULT, ChainLink, Contract, Row, write_contract

pytestmark = pytest.mark.usefixtures("as_users_run_it")  # refusals, and doubles of what is checked elsewhere

SHIPPED = Path(tracking.__file__).parent / "policies" / "groove-dancer" / "contract.json"
ARRAYS = [f.name for f in dataclasses.fields(Contract) if "ndarray" in str(f.type)]
REQUIRED = [f.name for f in dataclasses.fields(Contract) if f.default is f.default_factory is dataclasses.MISSING]


def small(rng=None, **changes):
    """A contract of three joints."""
    rng = rng or np.random.default_rng(0)
    numbers = {name: np.exp(np.clip(rng.normal(size=3) * 20.0, -40.0, 13.0)) for name in ARRAYS}  # over many magnitudes
    for pair in (("lower", "upper"), ("target_lower", "target_upper")):
        numbers |= dict(zip(pair, np.sort([numbers[name] for name in pair], axis=0), strict=True))
    link = ChainLink(pos=(0.1, -0.0, 1 / 3), quat=(1.0, 0.0, 0.0, 0.0), joint="b", axis=(0.0, 0.0, 1.0))
    rows = (
        Row(kind="gyro", at=-2, size=3, scale=0.25, unit="rad/s", frame="root body", noise=0.05),
        Row(kind="joint_pos", at=0, size=3, scale=1.0, unit="rad", frame="joint"),
    )
    told = dict(
        robot="r", robot_hash="", reference_sha256="0" * 64, control_dt=1 / 30, joint_names=("a", "b", "c"),
        target=FROM_DEFAULT, anchor="chest", anchor_chain=(link,), observation=rows, delay_trained_with_s=(0.0, 0.1),
    )  # fmt: skip
    return Contract(**(told | numbers | changes))


@pytest.mark.parametrize("seed", range(4))
def test_any_contract_survives_its_file_bit_for_bit(tmp_path, seed):
    ours = small(np.random.default_rng(seed), kd=np.array([0.0, 5e-324, 1e6]), versions={"torch": "2.é"})
    write_contract(tmp_path / "c.json", ours)
    theirs = read_contract(tmp_path / "c.json")
    for name in ARRAYS:
        assert getattr(ours, name).tobytes() == getattr(theirs, name).tobytes(), name
    for name in ("observation", "anchor_chain", "joint_names", "control_dt", "versions", "anchor", "target"):
        assert getattr(ours, name) == getattr(theirs, name), name
    assert theirs.source == str(tmp_path / "c.json")
    write_contract(tmp_path / "again.json", theirs)
    assert (tmp_path / "again.json").read_bytes() == (tmp_path / "c.json").read_bytes()


def test_the_file_tells_where_every_row_stands_and_what_the_target_means():
    told = small().as_dict()
    assert [row["slice"] for row in told["observation"]] == [[0, 3], [3, 6]]
    assert [row["name"] for row in told["observation"]] == ["gyro_2_ago", "joint_pos"]
    assert "default pose" in told["meaning"]["target"] and "source" not in told
    json.dumps(told, allow_nan=False)


@pytest.mark.parametrize(("at", "name"), [(0, "gyro"), (1, "gyro_1"), (5, "gyro_5"), (-1, "gyro_1_ago")])
def test_a_rows_name_says_when(at, name):
    assert Row(kind="gyro", at=at, size=3, scale=1.0, unit="", frame="").name == name


@pytest.mark.parametrize("key", REQUIRED)
def test_a_file_that_lacks_a_key_is_refused(tmp_path, key):
    told = json.loads(SHIPPED.read_text())
    del told[key]
    (tmp_path / "c.json").write_text(json.dumps(told))
    with pytest.raises(TrackingError, match=rf"c\.json: found .*{key}"):
        read_contract(tmp_path / "c.json")


@pytest.mark.parametrize("text", ["", "{", "[]", "3", '"contract"', b"\xff\xfe"])
def test_what_is_no_contract_at_all_is_refused_by_its_path(tmp_path, text):
    (tmp_path / "c.json").write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(TrackingError, match=r"c\.json.*expected (contract.json|2)"):
        read_contract(tmp_path / "c.json")
    with pytest.raises(TrackingError, match="nothing.json.*expected contract.json"):
        read_contract(tmp_path / "nothing.json")


@pytest.mark.parametrize("name", ARRAYS)
@pytest.mark.parametrize(
    "bad", [np.ones(2), np.ones((3, 1)), np.array([1.0, np.nan, 1.0]), np.array([1.0, np.inf, 1.0])]
)
def test_numbers_that_are_not_one_finite_number_per_joint_are_refused_by_name(name, bad):
    with pytest.raises(TrackingError, match=f"contract, {name}: .*expected 3 finite numbers"):
        small(**{name: bad})


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"joint_names": ("a", "b", "a")}, "joint_names"),
        ({"control_dt": 0.0}, "control_dt"),
        ({"control_dt": float("nan")}, "control_dt"),
        ({"kp": np.array([1.0, 0.0, 1.0])}, "kp, kd, effort"),
        ({"kd": np.array([1.0, -1e-9, 1.0])}, "kp, kd, effort"),
        ({"effort": np.array([1.0, -1.0, 1.0])}, "kp, kd, effort"),
        ({"target": ""}, "target"),
        ({"joint_names": ("a", "x", "c")}, "anchor_chain"),
    ],
)
def test_numbers_that_no_robot_has_are_refused(changes, said):
    with pytest.raises(TrackingError, match=f"contract, {said}"):
        small(**changes)


@pytest.mark.parametrize("quat", [(1.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.01), (0.0, 0.0, 0.0, 0.0)])
def test_a_link_that_is_no_rotation_is_refused(quat):
    link = dataclasses.replace(small().anchor_chain[0], quat=quat)
    with pytest.raises(TrackingError, match="unit quaternions"):
        small(anchor_chain=(link,))
    small(anchor_chain=(dataclasses.replace(link, quat=(0.5, -0.5, 0.5, -0.5)),))


@pytest.mark.parametrize("slices", [[[0, 3], [4, 7]], [[0, 3], [2, 5]], [[1, 4], [4, 7]], [[3, 6], [0, 3]]])
def test_rows_that_overlap_leave_gaps_or_stand_in_another_order_are_refused(tmp_path, slices):
    told = small().as_dict()
    for row, part in zip(told["observation"], slices, strict=True):
        row["slice"] = part
    (tmp_path / "c.json").write_text(json.dumps(told))
    with pytest.raises(TrackingError, match="side by side"):
        read_contract(tmp_path / "c.json")


def test_a_key_that_a_later_version_may_add_does_no_harm(tmp_path):
    (tmp_path / "c.json").write_text(json.dumps({**json.loads(SHIPPED.read_text()), "weather": "fine"}))
    assert read_contract(tmp_path / "c.json").robot == "dancer"
