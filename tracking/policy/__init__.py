"""A policy as files and as something that acts: contract, runner, bundle, other tools' forms. No trainer, no simulator."""

from tracking.policy.anchor_chain import anchor_chain
from tracking.policy.bundle import (
    CONTRACT,
    GOLDEN,
    POLICY,
    REFERENCE,
    SHIPPED,
    Bundle,
    check_contract,
    find_policy,
    load_bundle,
    read_runner,
)
from tracking.policy.contract import FROM_REFERENCE, OF_ROBOT, Contract, Row, read_contract, write_contract
from tracking.policy.feed_forward import joint_targets, target_range
from tracking.policy.gains import standing_gains, with_gains
from tracking.policy.golden_trace import TOLERANCE, Golden, read_golden, replay, write_golden
from tracking.policy.measurement import Measurement
from tracking.policy.motion import Motion, motion_of, one_after_another
from tracking.policy.network import Policy, onnx_policy
from tracking.policy.observation_terms import TERMS, row_of
from tracking.policy.policy_export import write_beyondmimic, write_unitree
from tracking.policy.readers import is_tracker, read_tracker
from tracking.policy.runner import Runner

__all__ = [
    "CONTRACT",
    "FROM_REFERENCE",
    "GOLDEN",
    "OF_ROBOT",
    "POLICY",
    "REFERENCE",
    "SHIPPED",
    "TERMS",
    "TOLERANCE",
    "Bundle",
    "Contract",
    "Golden",
    "Measurement",
    "Motion",
    "Policy",
    "Row",
    "Runner",
    "anchor_chain",
    "check_contract",
    "find_policy",
    "is_tracker",
    "joint_targets",
    "load_bundle",
    "motion_of",
    "one_after_another",
    "onnx_policy",
    "read_contract",
    "read_golden",
    "read_runner",
    "read_tracker",
    "replay",
    "row_of",
    "standing_gains",
    "target_range",
    "with_gains",
    "write_beyondmimic",
    "write_contract",
    "write_golden",
    "write_unitree",
]
