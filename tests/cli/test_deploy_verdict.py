"""What a rehearsal says of its end: whose fault it was, and what to do about a busy machine."""

from pathlib import Path

import pytest

from cli.deploying import Arguments, performance_verdict
from cli.shell.typed import remember


def numbers(stopped="nothing", dances=1):
    return {
        "stopped by": stopped, "messages with a bad CRC": 0, "dances finished": dances, "seconds": 13.2, "fell": False,
        "command period p50, p99, max [ms]": [20.0, 21.0, 25.0], "states heard in a second, least [Hz]": 490,
    }  # fmt: skip


def test_a_dance_to_its_end_passes():
    remember("dance-deploy", ["groove-g1", "--rehearse"])
    assert performance_verdict(numbers(), Arguments(bundle=Path("groove-g1"), rehearse=True)).passed


@pytest.mark.parametrize(
    ("stopped", "busy"),
    [
        ("no command for 71 ms", True),
        ("the keeper hung for 60 ms", True),
        ("falling: 0.84 rad", False),
    ],
)
def test_a_busy_machine_is_told_from_a_policy_that_falls(stopped, busy):
    remember("dance-deploy", ["groove-g1", "--rehearse", "--fault", "battery"])
    args = Arguments(bundle=Path("groove-g1"), rehearse=True, fault="battery")
    verdict = performance_verdict(numbers(stopped, 0), args)
    cures = [cure for trouble in verdict.troubles for cure in trouble.cures]
    assert not verdict.passed and bool(cures) == busy
    if busy:
        assert (
            "before battery came of it" in cures[0][0]
            and cures[0][1] == "dance-deploy groove-g1 --rehearse --fault battery"
        )


@pytest.mark.parametrize(
    ("fault", "stopped"),
    [
        ("battery", "battery: 38.0 V"),
        ("loss", "lost states: 349 of 502 in a second came in"),
        ("tilt", "tilt: 1.10 rad"),
    ],
)
def test_a_fault_that_is_noticed_is_what_was_rehearsed(fault, stopped):
    remember("dance-deploy", ["groove-g1", "--rehearse", "--fault", fault])
    args = Arguments(bundle=Path("groove-g1"), rehearse=True, fault=fault)
    verdict = performance_verdict(numbers(stopped, 0), args)
    assert verdict.passed and fault in verdict.line and stopped in verdict.numbers[0]
    plain = performance_verdict(numbers(stopped, 0), Arguments(bundle=Path("groove-g1"), rehearse=True))
    assert not plain.passed  # without a fault asked for it is one
