"""Shapes in annotations are enforced in the test run only; shared fixtures."""

import os
from pathlib import Path

os.environ.setdefault("GIT_PYTHON_REFRESH", "quiet")

from jaxtyping import install_import_hook

install_import_hook(["robot_models", "clips", "retarget"], "shape_checker.checked")

import numpy as np
import pytest

SAMPLES = Path(__file__).parent.parent / "clips" / "samples"
SHARED = Path(__file__).parent.parent.parent / "shared" / "clips"


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


@pytest.fixture
def shared():
    if not SHARED.is_dir():
        pytest.skip("the shared clips are not on this machine")
    return SHARED
