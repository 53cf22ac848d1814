"""`dance-inspect`: what it tells follows what it is told, and it writes nothing."""

import numpy as np
import pytest
from conftest import SAMPLES

from cli.inspect import main
from robot_models import load_robot


def told(capsys, *words):
    code = main([str(w) for w in words])
    caught = capsys.readouterr()
    assert code == (1 if "cannot be used" in caught.out else 0), caught.err
    return caught.out


@pytest.fixture
def joints(tmp_path):
    """A second of a standing G1, headerless."""
    np.savetxt(tmp_path / "m.csv", np.tile(load_robot("g1").default_qpos, (31, 1)), delimiter=",")
    return tmp_path / "m.csv"


@pytest.mark.parametrize("name", ["groove.bvh", "groove.csv"])
def test_one_dance_in_two_layouts_is_described_alike(name, capsys):
    said = told(capsys, SAMPLES / name)
    assert "10.00 s" in said and "height" in said and "15 of" not in said.split("landmarks")[0]
    heights = [float(line.split()[1]) for line in said.splitlines() if line.startswith("height")]
    assert heights == [pytest.approx(1.65, abs=0.15)]


@pytest.mark.parametrize("fps", [30, 60])
def test_a_stated_rate_is_believed_and_gives_the_length(joints, capsys, fps):
    said = told(capsys, joints, "--fps", fps, "--quat-order", "wxyz")
    assert f"31 frames, {30 / fps:.2f} s" in said and f"at {fps} per second" in said
    assert "29 of g1" in said and "does not say its rate" not in said


def test_a_statement_stands_as_stated(capsys):
    assert "stated" in told(capsys, SAMPLES / "groove.bvh", "--unit", "cm")


@pytest.mark.parametrize(("name", "whole"), [("groove.bvh", True), ("groove.csv", False)])
def test_a_clip_that_needs_repair_says_so_and_cannot_be_used_strictly(name, whole, capsys):
    mild, strict = told(capsys, SAMPLES / name), told(capsys, SAMPLES / name, "--strict")
    assert ("repair" not in mild) == whole and "cannot be used" not in mild
    assert ("cannot be used" not in strict) == whole


def test_every_line_of_evidence_stands_under_what_it_is_evidence_for(capsys):
    lines = told(capsys, SAMPLES / "groove.bvh").partition("\ncheck ")[0].splitlines()[1:]
    assert len(lines) % 2 == 0
    assert all(line[0] != " " for line in lines[::2]) and all(line.startswith(" " * 18) for line in lines[1::2])


@pytest.mark.parametrize("content", [b"", b"\x00\xff" * 50, b"just a text\n"])
def test_what_is_no_motion_is_refused(tmp_path, capsys, content):
    (tmp_path / "a.bvh").write_bytes(content)
    assert main([str(tmp_path / "a.bvh")]) == 2
    assert capsys.readouterr().err.startswith("refused: ")


def test_nothing_is_written(joints, capsys, monkeypatch):
    monkeypatch.chdir(joints.parent)
    told(capsys, joints, "--fps", 30, "--quat-order", "wxyz")
    assert [p.name for p in joints.parent.iterdir()] == ["m.csv"]


def test_checks_are_told_with_number_verdict_and_where(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "200")
    table = told(capsys, SAMPLES / "groove.bvh").partition("\ncheck ")[2]
    for what in ("bones keep their length", "feet stand while the body travels", "the floor is level", "flights fall"):
        assert what in table
    assert table.count("holds") == 5 and "no flight" in table
