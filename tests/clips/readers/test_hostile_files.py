"""Files that nobody should open: refused in time and within memory, and nothing of them is run or written."""

import os
import subprocess
import sys
from pathlib import Path

import hostile
import pytest
from conftest import ROOT

from robot_models import RobotError, load_robot
from robot_models.profile import PROFILES
from robot_models.visual import _mesh_path

SECONDS, MEGABYTES = 10.0, 1000

# Every file alone in the peak memory: Linux forgets the peak on request.
JUDGE = """
import sys, time
from pathlib import Path
from clips import ReadOptions, read_clip
from robot_models import DanceError, load_robot

def memory(key):
    return next(int(s.split()[1]) // 1024 for s in Path("/proc/self/status").read_text().splitlines() if s.startswith(key))

load_robot("dancer"), load_robot("g1")
for path in sorted(Path(sys.argv[1]).iterdir()):
    Path("/proc/self/clear_refs").write_text("5")
    before, began, end = memory("VmRSS"), time.monotonic(), "read"
    try:
        read_clip(path, ReadOptions(fps=30.0))
    except DanceError as e:
        end = "refused"
    except BaseException as e:
        end = type(e).__name__
    print(f"{path.name} {end} {time.monotonic() - began:.2f} {memory('VmHWM') - before}", flush=True)
"""


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/clear_refs").exists(), reason="needs Linux to measure")
def test_every_hostile_file_is_refused_in_time_and_memory(tmp_path):
    good = hostile.files()
    for name, data in good.items():
        (tmp_path / name).write_bytes(data)
    cwd = tmp_path.parent / "work"
    cwd.mkdir()
    told = subprocess.run(
        [sys.executable, "-c", JUDGE, str(tmp_path)], capture_output=True, text=True, check=True, timeout=300, cwd=cwd,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
    )  # fmt: skip
    lines = [line.split() for line in told.stdout.splitlines()]
    assert len(lines) == len(good)
    for name, end, seconds, megabytes in lines:
        assert end == "refused", (name, end)
        assert float(seconds) < SECONDS and float(megabytes) < MEGABYTES, (name, seconds, megabytes)
    assert not list(cwd.iterdir())
    assert not list(Path("/tmp").glob("dance-was-here*"))


def test_a_robot_with_xml_entities_is_refused(tmp_path):
    text = (PROFILES / "talos.toml").read_text()
    profile = text.replace(
        'package = "example-robot-data"\npath = "robots/talos_data/robots/talos_reduced.urdf"', 'path = "x.urdf"', 1
    )
    (tmp_path / "x.toml").write_text(profile)
    (tmp_path / "x.urdf").write_text(
        '<!DOCTYPE r [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;">]><robot name="&b;"><link name="base_link"/></robot>'
    )
    with pytest.raises(RobotError, match="XML entities"):
        load_robot(str(tmp_path / "x.toml"))


@pytest.mark.parametrize(
    "name", ["package://robot/../../../../../../etc/passwd", "/etc/passwd", "package://etc/passwd", "../" * 9 + "x.stl"]
)
def test_a_mesh_outside_the_robots_package_is_not_looked_at(tmp_path, name):
    urdf = tmp_path / "robot" / "urdf" / "x.urdf"
    urdf.parent.mkdir(parents=True)
    assert _mesh_path(name, urdf) is None
    mesh = tmp_path / "robot" / "meshes" / "x.stl"
    mesh.parent.mkdir()
    mesh.write_bytes(b"solid")
    assert _mesh_path("package://robot/meshes/x.stl", urdf) == mesh
    assert _mesh_path("package:///robot/meshes/x.stl", urdf) == mesh
    assert _mesh_path("../meshes/x.stl", urdf) == mesh
