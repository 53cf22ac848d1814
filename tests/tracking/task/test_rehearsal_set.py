"""References in few bits: small, and whole again to what their docstring says."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from clips import load_reference
from robot_models import load_robot
from robot_models.maths import rotation as rot
from tracking import TrackingError
from tracking.policy.bundle import SHIPPED
from tracking.task import NamedReference, read_rehearsal_set, write_rehearsal_set

FILE = SHIPPED / "groove-dancer" / "reference.npz"


@pytest.fixture(scope="module")
def pieces(dancer):
    one = load_reference(FILE, dancer)
    odd = dataclasses.replace(one, segments=np.array([[0, one.frames, 0]]), meta={"segment_names": ["dance"]})
    return [
        NamedReference(name=name, reference=r, path=Path(FILE), sha256="") for name, r in (("one", one), ("two", odd))
    ]


def test_what_comes_out_is_what_went_in_to_a_few_milliradians(dancer, pieces, tmp_path):
    path = tmp_path / "set.npz"
    write_rehearsal_set(path, pieces, "by nobody")
    again = read_rehearsal_set(path, dancer)
    assert [p.name for p in again] == ["one", "two"]
    for before, after in zip((p.reference for p in pieces), (p.reference for p in again), strict=True):
        assert np.abs(before.joint_pos - after.joint_pos).max() < 5e-3
        assert np.abs(before.body_pos_w - after.body_pos_w).max() < 3e-3
        assert rot.angle_between(before.body_quat_w, after.body_quat_w).max() < 1e-2
        assert np.abs(before.joint_torque - after.joint_torque).mean() < 0.02 * np.abs(before.joint_torque).max()
        np.testing.assert_array_equal(before.segments, after.segments)
        assert (before.fps, before.dance) == (after.fps, after.dance)
    assert path.stat().st_size < 0.1 * FILE.stat().st_size * len(pieces)


def test_what_is_no_set_of_this_robot_is_refused(dancer, pieces, tmp_path):
    with pytest.raises(TrackingError, match="no rehearsal set"):
        read_rehearsal_set(tmp_path / "none.npz", dancer)
    with pytest.raises(TrackingError, match="no rehearsal set"):
        read_rehearsal_set(FILE, dancer)
    write_rehearsal_set(tmp_path / "set.npz", pieces, "by nobody")
    with pytest.raises(TrackingError, match="motions of dancer"):
        read_rehearsal_set(tmp_path / "set.npz", load_robot("g1"))
