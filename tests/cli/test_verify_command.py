"""`dance-verify`: gates, sources and robots as they are, not as they were said to be."""

import dataclasses

import pytest

from cli.verify import main
from clips import load_reference, metric_label, save_reference


@pytest.fixture
def alone(groove_file, tmp_path):
    """The reference, away from its source."""
    (tmp_path / "r.npz").write_bytes(groove_file.read_bytes())
    return tmp_path / "r.npz"


def test_without_its_source_it_says_so_and_is_content(alone, capsys):
    assert main([str(alone)]) == 0
    said = capsys.readouterr().out
    assert "not here" in said and "groove.bvh" in said and "--source" in said and "FAIL" not in said


def test_a_gate_that_was_missed_fails_by_name(alone, capsys):
    reference = load_reference(alone)
    report = dict(reference.meta["report"])
    name = next(k for k, told in report.items() if told["limit"] is not None)
    report[name] = report[name] | {"passed": False}
    save_reference(dataclasses.replace(reference, meta=reference.meta | {"report": report}), alone)
    assert main([str(alone)]) == 1
    assert f"missed when it was made: {metric_label(name)}" in capsys.readouterr().out


def test_a_source_of_the_same_name_beside_it_is_looked_at_unasked(alone, capsys):
    (alone.parent / "groove.bvh").write_bytes(b"another dance")
    assert main([str(alone)]) == 1
    assert "is not what it was made from" in capsys.readouterr().out


def test_single_precision_is_whole_too(alone, tmp_path):
    save_reference(load_reference(alone), tmp_path / "f32.npz", float32=True)
    assert main([str(tmp_path / "f32.npz")]) == 0


@pytest.mark.parametrize("words", [["--robot", "g1"], ["--robot", "nobody"]])
def test_another_robots_reference_is_refused(alone, capsys, words):
    assert main([str(alone), *words]) == 2
    assert capsys.readouterr().err.startswith("refused: ")


def test_what_is_no_reference_is_refused_and_left_alone(alone, capsys):
    other = alone.with_name("other.npz")
    other.write_bytes(b"no archive")
    for path in (other, alone.with_name("absent.npz")):
        assert main([str(path)]) == 2
        assert path.name in capsys.readouterr().err
    assert other.read_bytes() == b"no archive"
