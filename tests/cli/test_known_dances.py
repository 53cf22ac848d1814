"""Dances that a tracker knows are named, not looked for: judged, shown and refused by their names."""

import json
import shutil

import pytest
from excerpt import excerpt

pytest.importorskip("onnxruntime")

import cli.evaluate
import cli.play
import cli.view


@pytest.fixture(scope="module")
def repertoire(tmp_path_factory):
    """The shipped tracker beside two short dances."""
    from clips import load_reference
    from tracking import REHEARSAL
    from tracking.policy import CONTRACT, POLICY, SHIPPED
    from tracking.task import NamedReference, write_rehearsal_set

    folder = tmp_path_factory.mktemp("policies") / "two-g1"
    folder.mkdir()
    for name in (CONTRACT, POLICY):
        shutil.copyfile(SHIPPED / "tracker-g1" / name, folder / name)
    file = SHIPPED / "groove-g1" / "reference.npz"
    whole = load_reference(file)

    def part(name, first, last):
        return NamedReference(name=name, reference=excerpt(whole, first, last), path=file, sha256="")

    write_rehearsal_set(folder / REHEARSAL, [part("first", 60, 160), part("second", 160, 240)], "by nobody")
    return folder


def test_a_row_for_each_dance_that_a_tracker_knows_and_one_alone_by_its_name(repertoire, tmp_path, capsys):
    one, both = tmp_path / "one.json", tmp_path / "both.json"
    cli.evaluate.main([str(repertoire), "--rollouts", "2", "--json", str(both)])
    assert "2 dances; least" in capsys.readouterr().out
    cli.evaluate.main([str(repertoire), "--dance", "second", "--rollouts", "2", "--json", str(one)])
    alone, rows = json.loads(one.read_text())["results"], json.loads(both.read_text())["results"]
    assert list(rows) == ["first", "second"]
    assert rows["second"] == alone != rows["first"]


def test_a_dance_that_it_does_not_know_is_refused_with_those_that_it_does(repertoire, groove_file, capsys):
    assert cli.evaluate.main([str(repertoire), "--dance", "third"]) == 2
    assert "first, second" in capsys.readouterr().err
    assert cli.evaluate.main([str(repertoire), "--dance", "first", "--ref", str(groove_file)]) == 2
    assert "one of the two" in capsys.readouterr().err
    assert cli.evaluate.main(["groove-g1", "--dance", "first"]) == 2  # a policy of one dance
    assert "as tracker-g1" in capsys.readouterr().err
    assert cli.play.main([str(repertoire)]) == 2
    assert "one that it knows: first, second" in " ".join(capsys.readouterr().err.split())
    assert cli.evaluate.main([str(repertoire), "--sweep"]) == 2  # of which?
    assert "--dance first" in capsys.readouterr().err


def test_a_page_of_a_dance_by_its_name(repertoire, tmp_path, capsys):
    assert cli.view.main([str(groove := tmp_path / "groove.npz"), "--dance", "first"]) == 2
    assert "a tracker, which follows it" in capsys.readouterr().err and not groove.exists()
    assert cli.view.main([str(repertoire), "--dance", "second", "--web", str(tmp_path / "second.html")]) == 0
    assert (tmp_path / "second.html").stat().st_size > 1e5
