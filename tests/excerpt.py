"""A few frames of a reference: what a test needs that asks how a run goes, not how a dance."""

import dataclasses

import numpy as np

OVER_FRAMES = (
    "joint_pos", "joint_vel", "body_pos_w", "body_quat_w", "body_lin_vel_w", "body_ang_vel_w", "contact", "joint_torque",
)  # fmt: skip


def excerpt(whole, start, stop):
    """The frames `start` to `stop` of a reference, all of them its dance."""
    return dataclasses.replace(
        whole, **{name: getattr(whole, name)[start:stop] for name in OVER_FRAMES}, segments=np.array([[0, stop - start, 0]]),
        meta={**whole.meta, "segment_names": ["dance"]},
    )  # fmt: skip
