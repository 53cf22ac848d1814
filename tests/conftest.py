"""Shapes in annotations are enforced in the test run only; shared fixtures."""

import os
from pathlib import Path

os.environ.setdefault("GIT_PYTHON_REFRESH", "quiet")
os.environ["DANCE_ROBOTS"] = ""  # the robots of who runs the tests are not the tests'
os.environ.setdefault(
    "OMP_NUM_THREADS", "1"
)  # threads that spin for one another take forty times as long on shared cores

from jaxtyping import install_import_hook

install_import_hook(["robot_models", "clips", "retarget", "tracking"], "shape_checker.checked")

import jaxtyping
import numpy as np
import pytest

from robot_models import load_robot
from robot_models.maths import rotation as rot

ROOT = Path(__file__).parent.parent
SAMPLES = ROOT / "clips" / "samples"
SHARED = ROOT.parent / "shared" / "clips"


@pytest.fixture
def rng():
    return np.random.default_rng(0)


@pytest.fixture(scope="session")
def dancer():
    from robot_models import load_robot

    return load_robot("dancer")


@pytest.fixture(scope="session")
def groove():
    """The sample dance retargeted to the dancer, its first four seconds."""
    from clips import cut, read_clip
    from retarget import retarget
    from robot_models import load_robot

    return retarget(cut(read_clip(SAMPLES / "groove.bvh"), 0.0, 4.0), load_robot("dancer"))


@pytest.fixture(scope="session")
def groove_file(groove, tmp_path_factory):
    from clips import save_reference

    path = tmp_path_factory.mktemp("reference") / "groove.npz"
    save_reference(groove.reference, path)
    return path


@pytest.fixture(scope="session")
def shared():
    if not SHARED.is_dir():
        pytest.skip("the shared clips are not on this machine")
    return SHARED


@pytest.fixture
def motion(rng):
    """A G1 that sways on its feet: root position, root wxyz, joints."""
    robot = load_robot("g1")
    t = np.arange(90) / 30
    qpos = np.tile(robot.default_qpos, (90, 1))
    qpos[:, 3:7] = rot.from_yaw(0.9 + 0.2 * np.sin(t))
    qpos[:, 7 + robot.joint("left_shoulder_pitch_joint")] += 0.5 * np.sin(3 * t)
    qpos[:, 7 + robot.joint("right_elbow_joint")] += 0.3 * np.cos(2 * t)
    return qpos


@pytest.fixture
def as_users_run_it():
    """Without the shape checks of the test run, which would be the first to refuse: for refusals, and for doubles."""
    jaxtyping.config.update("jaxtyping_disable", True)
    yield
    jaxtyping.config.update("jaxtyping_disable", False)
