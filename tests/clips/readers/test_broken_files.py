"""Broken files of every kind: refused, never a traceback, whatever byte is wrong."""

import random

import numpy as np
import pytest
from conftest import SAMPLES
from other_tools import glb, motive, mvnx, point_files, smpl_files, steps_on_the_spot, trc, vmd
from test_amc_deepmimic import deepmimic, motion, rest, skeleton
from test_other_layouts import trajectory
from test_other_tools import the_dance

from clips import ReadOptions, read_clip, save_reference
from clips.writers import LAYOUTS, write_motion
from robot_models import DanceError, load_robot

WORDS = [
    b"nan",
    b"inf",
    b"-1",
    b"1e308",
    b"",
    b"999999999999",
    b"{",
    b"}",
    b"ROOT",
    b"\xff\xfe",
    b",",
    b":root",
    b"begin",
]
PER_FILE = 60


@pytest.fixture(scope="module")
def files(groove, tmp_path_factory):
    """One good file of every layout that is read."""
    folder = tmp_path_factory.mktemp("good")
    save_reference(groove.reference, folder / "ours.npz")
    clip = read_clip(folder / "ours.npz")
    for name, layout in LAYOUTS.items():
        write_motion(folder / f"{name}{layout.suffix}", name, clip, load_robot("dancer"))
    trajectory(folder / "loco.npz", load_robot("dancer"))
    skeleton(folder / "acclaim.asf")
    motion(folder / "acclaim.amc", np.random.default_rng(0))
    deepmimic(folder / "deepmimic.txt", rest().tolist())
    dance = the_dance()
    smpl_files(folder, dance)
    point_files(folder, dance)
    trc(folder / "dance.trc", dance), mvnx(folder / "dance.mvnx", dance), motive(folder / "motive.csv", dance)
    glb(folder / "dance.glb", dance), vmd(folder / "dance.vmd", steps_on_the_spot())
    for sample in ("groove.bvh", "groove.csv"):
        (folder / sample).write_bytes((SAMPLES / sample).read_bytes()[:40_000])
    return sorted(p for p in folder.iterdir() if p.suffix != ".asf")


def broken(data, rng):
    data = bytearray(data)
    for _ in range(rng.choice((1, 1, 2, 5))):
        at = rng.randrange(len(data)) if rng.random() < 0.5 else rng.randrange(min(len(data), 3000))
        kind = rng.randrange(4)
        if kind == 0:
            data[at] = rng.randrange(256)
        elif kind == 1:
            del data[at : at + rng.choice((1, 3, 50, 1000))]
        else:
            data[at : at + (4 if kind == 3 else 0)] = rng.choice(WORDS)
        data = data or bytearray(b"x")
    return bytes(data)


def test_a_broken_file_is_refused_or_read_and_nothing_else(files, tmp_path):
    rng, refused = random.Random(0), 0
    for good in files:
        data, asf = good.read_bytes(), good.with_name("acclaim.asf").read_bytes()
        for _ in range(PER_FILE):
            of_skeleton = good.suffix == ".amc" and rng.random() < 0.4
            path = tmp_path / f"x{good.suffix}"
            path.write_bytes(data if of_skeleton else broken(data, rng))
            (tmp_path / "x.asf").write_bytes(broken(asf, rng) if of_skeleton else asf)
            try:
                read_clip(path, ReadOptions(fps=rng.choice((None, 30.0))))
            except DanceError:
                refused += 1
    assert refused > 0.3 * PER_FILE * len(files)  # it is the breaking that is tried, not the good files
