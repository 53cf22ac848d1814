"""How well a policy performs: rollouts of the whole dance, one condition after another, and what a reference is worth."""

from tracking.evaluation.certificate import CERTIFICATE, Certificate, certify, read_certificate, write_certificate
from tracking.evaluation.condition_sweep import Cell, by_condition, sweep
from tracking.evaluation.danced import danced_reference
from tracking.evaluation.live import Hindrance, LiveDance
from tracking.evaluation.pose_stream import PoseStream, stream_policy, stream_reference
from tracking.evaluation.reference_check import ReferenceCheck, check_reference
from tracking.evaluation.rollouts import Evaluation, evaluate, evaluation_task, play, start
from tracking.evaluation.standing import Standing, judge_standing

__all__ = [
    "CERTIFICATE",
    "Cell",
    "Certificate",
    "Evaluation",
    "Hindrance",
    "LiveDance",
    "PoseStream",
    "ReferenceCheck",
    "Standing",
    "by_condition",
    "certify",
    "check_reference",
    "danced_reference",
    "evaluate",
    "evaluation_task",
    "judge_standing",
    "play",
    "read_certificate",
    "start",
    "stream_policy",
    "stream_reference",
    "sweep",
    "write_certificate",
]
