"""A `Reference` holds what it promises: counts by its names, unit quaternions, kinds and ranges that exist, nothing writable."""

import dataclasses

import numpy as np
import pytest

from clips import ReferenceFileError

ARRAYS = (
    "joint_pos", "joint_vel", "joint_torque", "body_pos_w", "body_quat_w", "body_lin_vel_w", "body_ang_vel_w", "contact",
    "segments",
)  # fmt: skip


@pytest.mark.usefixtures("as_users_run_it")
@pytest.mark.parametrize(
    ("broken", "named"),
    [
        (lambda r: {"fps": 0.0}, "fps"),
        (lambda r: {"fps": float("nan")}, "fps"),
        (lambda r: {"joint_names": r.joint_names[:-1]}, "joint_pos"),
        (lambda r: {"joint_names": (r.joint_names[0], *r.joint_names[:-1])}, "joint_names"),
        (lambda r: {"body_names": r.body_names[:-1]}, "body_pos_w"),
        (lambda r: {"joint_torque": r.joint_torque[:, :-1]}, "joint_torque"),
        (lambda r: {"joint_vel": r.joint_vel[:-1]}, "joint_vel"),
        (lambda r: {"body_lin_vel_w": r.body_lin_vel_w[:, :-1]}, "body_lin_vel_w"),
        (lambda r: {"body_quat_w": 1.01 * r.body_quat_w}, "body_quat_w"),
        (lambda r: {"body_quat_w": r.body_quat_w * np.nan}, "body_quat_w"),
        (lambda r: {"contact": r.contact[:-1]}, "contact"),
        (lambda r: {"contact": r.contact[:, :2]}, "contact"),
        (lambda r: {"contact": r.contact + 99}, "contact"),
        (lambda r: {"segments": r.segments + r.frames}, "segments"),
        (lambda r: {"segments": r.segments[::-1]}, "segments"),
        (lambda r: {"segments": r.segments[:0]}, "segments"),
        (lambda r: {"segments": r.segments + [[0, 0, 5]]}, "segments"),
        (lambda r: {"segments": r.segments[:, :2]}, "segments"),
    ],
)
def test_what_does_not_fit_is_refused_by_name(groove, broken, named):
    with pytest.raises(ReferenceFileError, match=named):
        dataclasses.replace(groove.reference, **broken(groove.reference))
    dataclasses.replace(groove.reference)  # the control: unbroken it is made


@pytest.mark.parametrize("name", ARRAYS)
def test_no_array_can_be_written_to_and_none_is_the_callers(groove, name):
    array = np.array(getattr(groove.reference, name))
    made = dataclasses.replace(groove.reference, **{name: array})
    with pytest.raises(ValueError, match="read-only"):
        getattr(made, name)[0] = 0
    array[:] = 0
    np.testing.assert_array_equal(getattr(made, name), getattr(groove.reference, name))
