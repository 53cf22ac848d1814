"""Over the robot's own messages, in processes of their own: who hears whom, and what a fault leaves on the wire."""

import subprocess
import sys

import pytest
from conftest import ROOT

pytestmark = pytest.mark.slow

SPEAK = """
import sys, time, numpy as np
from tracking.deploy.messages import Command, State
from tracking.deploy.transport import MOTORS, ControllerTransport, RobotTransport
what, tag = sys.argv[1:]
if what == "robot":
    end = RobotTransport(tag)
    state = State(quat=np.array([1.0, 0, 0, 0]), gyro=np.zeros(3), joint_pos=np.zeros(29), joint_vel=np.zeros(29), received=0.0)
    say = lambda k: end.publish(State(**(vars(state) | {"gyro": np.full(3, 1e-6 * k)})))
else:
    end = ControllerTransport("lo", MOTORS, tag=tag, listen=False)
    say = lambda k: end.write(Command(target=np.zeros(29), kp=np.zeros(29), kd=np.ones(29)))
print("speaking", flush=True)
for k in range(4000):
    say(k)
    time.sleep(0.002)
"""
HEAR = """
import sys, time
from tracking.deploy.transport import MOTORS, ControllerTransport
what, tag = sys.argv[1:]
end = ControllerTransport("lo", MOTORS, tag=tag)
time.sleep(1.0)
if what == "robot":
    print("HEARD", end.read() is not None)
else:
    try:
        end.refuse_other_commanders()
        print("HEARD", False)
    except Exception as e:
        print("HEARD", "somebody else" in str(e))
"""


@pytest.mark.parametrize("what", ["robot", "commands"])
@pytest.mark.parametrize(
    ("theirs", "ours", "heard"), [("", "", True), ("a", "a", True), ("a", "b", False), ("a", "", False)]
)
def test_who_belongs_to_another_rehearsal_is_not_heard(what, theirs, ours, heard):
    pytest.importorskip("unitree_interface")
    speaker = subprocess.Popen([sys.executable, "-c", SPEAK, what, theirs], stdout=subprocess.PIPE, text=True, cwd=ROOT)
    try:
        while "speaking" not in (line := speaker.stdout.readline()):
            assert line
        done = subprocess.run(
            [sys.executable, "-c", HEAR, what, ours], capture_output=True, text=True, timeout=60, check=True, cwd=ROOT
        )
    finally:
        speaker.kill()
        speaker.wait()
        speaker.stdout.close()
    assert f"HEARD {heard}" in done.stdout


@pytest.mark.parametrize(
    "kind", ["controller: SIGTERM", "controller: SIGKILL", "keeper: SIGKILL", "policy: exception", "robot: battery"]
)
def test_a_fault_on_the_wire_ends_in_damping_and_nothing_stiff_after_it(kind, tmp_path):
    pytest.importorskip("unitree_interface")
    sys.path.insert(0, str(ROOT / "benchmarks"))
    try:
        from wire_faults import trial
    finally:
        sys.path.pop(0)
    told = trial(kind, 1.0, tmp_path)
    # A machine that stands still may be late, as the benchmark's table counts; what must never be is no damping at all.
    assert told["outcome"] in ("damped", "late"), told
