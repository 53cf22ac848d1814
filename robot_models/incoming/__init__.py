"""What comes in from outside: how large, deep and long it may be, and the doors that hold it to that."""

from robot_models.incoming.archive import read_array, read_arrays, refuse_bombs
from robot_models.incoming.child import refusal_of_child
from robot_models.incoming.files import expanded, parsed, read_bytes, read_text, reading, regular_file
from robot_models.incoming.limits import (
    CHILD_BYTES,
    CHILD_SECONDS,
    MAX_BODIES,
    MAX_CONFIG,
    MAX_ELEMENTS,
    MAX_FILE,
    MAX_MODEL,
    MAX_NAME,
    MAX_NETWORK,
    MAX_UNPACKED,
)
from robot_models.incoming.motors import motor_efforts
from robot_models.incoming.names import check_pattern, file_name, printable
from robot_models.incoming.one_joint import split_joints
from robot_models.incoming.serial import Linkage, make_serial
from robot_models.incoming.upright import turn_upright, turned, turns_of

__all__ = [
    "CHILD_BYTES",
    "CHILD_SECONDS",
    "MAX_BODIES",
    "MAX_CONFIG",
    "MAX_ELEMENTS",
    "MAX_FILE",
    "MAX_MODEL",
    "MAX_NAME",
    "MAX_NETWORK",
    "MAX_UNPACKED",
    "Linkage",
    "check_pattern",
    "expanded",
    "file_name",
    "make_serial",
    "motor_efforts",
    "parsed",
    "printable",
    "read_array",
    "read_arrays",
    "read_bytes",
    "read_text",
    "reading",
    "refusal_of_child",
    "refuse_bombs",
    "regular_file",
    "split_joints",
    "turn_upright",
    "turned",
    "turns_of",
]
