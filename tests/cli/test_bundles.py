"""From a bundle to other engines and other forms, by the commands."""

import functools
import json

import numpy as np
import pytest

pytest.importorskip("onnxruntime")

import cli.evaluate
import cli.export


@pytest.mark.slow
def test_an_exported_bundle_stands_alone_and_is_judged_as_before(tmp_path, capsys):
    pytest.importorskip("onnx")
    out = tmp_path / "bundle"
    assert cli.export.main(["groove-dancer", "-o", str(out)]) == 0
    names = {"policy.onnx", "contract.json", "golden.npz", "reference.npz", "beyondmimic.onnx", "deploy.yaml"}
    assert {p.name for p in out.iterdir()} == names and not list(tmp_path.glob(".*"))
    assert "golden trace repeated" in capsys.readouterr().out
    files = [tmp_path / "a.json", tmp_path / "b.json"]
    for bundle, file in zip(("groove-dancer", str(out)), files, strict=True):
        cli.evaluate.main([bundle, "--rollouts", "3", "--json", str(file)])
    first, second = (json.loads(file.read_text())["results"] for file in files)
    assert first == second
    assert cli.export.main(["groove-dancer", "-o", str(out)]) == 2  # nothing is overwritten
    assert "already there" in capsys.readouterr().err


def test_a_golden_trace_that_is_not_repeated_stops_everything(tmp_path, capsys):
    import shutil

    from tracking.policy.bundle import SHIPPED

    shutil.copytree(SHIPPED / "groove-dancer", tmp_path / "b")
    with np.load(tmp_path / "b" / "golden.npz") as file:
        data = dict(file)
    data["action"] = data["action"] + 0.01
    np.savez(tmp_path / "b" / "golden.npz", **data)
    assert cli.evaluate.main([str(tmp_path / "b")]) == 2
    assert "golden trace, action" in capsys.readouterr().err


def test_a_bundle_without_its_reference_is_refused(tmp_path, capsys):
    import shutil

    from tracking.policy.bundle import SHIPPED

    shutil.copytree(SHIPPED / "groove-dancer", tmp_path / "b")
    (tmp_path / "b" / "reference.npz").unlink()
    assert cli.evaluate.main([str(tmp_path / "b")]) == 2
    assert "no reference" in capsys.readouterr().err


@pytest.mark.slow
def test_engines_stand_side_by_side_and_an_unknown_one_is_refused(tmp_path, capsys):
    pytest.importorskip("sapien")
    file = tmp_path / "e.json"
    words = ["groove-dancer", "--rollouts", "2", "--json", str(file), "--recording", str(tmp_path / "e.rrd")]
    code = cli.evaluate.main([*words, "--engine", "physx-isaac"])
    told = json.loads(file.read_text())["results"]["physx-isaac"]
    assert code in (0, 1) and told["rollouts"] == 2 and told["survived_s"] > 3.0
    assert (tmp_path / "e.rrd").stat().st_size > 1000
    assert cli.evaluate.main(["groove-dancer", "--engine", "bullet"]) == 2
    assert "physx-motor" in capsys.readouterr().err


@pytest.mark.slow
def test_a_sweep_is_a_table_a_file_and_a_picture(tmp_path, monkeypatch, capsys):
    pytest.importorskip("sapien")
    pytest.importorskip("matplotlib")
    import tracking

    kept = ("nominal", "delay 40 ms", "friction 0.3")
    monkeypatch.setattr(tracking, "sweep", functools.partial(tracking.sweep, conditions=kept))
    words = ["groove-dancer", "--sweep", "--rollouts", "2", "--engine", "all", "--jobs", "2"]
    cli.evaluate.main([*words, "--json", str(tmp_path / "s.json"), "--picture", str(tmp_path / "s.png")])
    cells = json.loads((tmp_path / "s.json").read_text())["cells"]
    assert [(c["condition"], c["engine"]) for c in cells] == [
        (c, e) for c in kept for e in ("mujoco", "physx-isaac", "physx-motor")
    ]
    assert (tmp_path / "s.png").read_bytes().startswith(b"\x89PNG")
    assert "friction 0.3" in capsys.readouterr().out


def test_a_tracker_needs_no_export_and_the_refusal_says_what_to_do(capsys, tmp_path):
    from cli.export import main as export

    assert export(["tracker-g1", "-o", str(tmp_path / "out")]) == 2
    assert "dance-deploy tracker-g1 --ref" in " ".join(capsys.readouterr().err.split())
