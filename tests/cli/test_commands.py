"""The commands as a user types them: exit codes, files, refusals with the line to type, help with examples."""

import json
import re
import shlex

import numpy as np
import pytest
from conftest import ROOT, SAMPLES

import cli.certify
import cli.compare
import cli.convert
import cli.deploy
import cli.doctor
import cli.evaluate
import cli.export
import cli.inspect
import cli.play
import cli.report
import cli.retarget
import cli.robot
import cli.train
import cli.verify
import cli.view
from cli.shell.terminal import parse

COMMANDS = {
    "dance-retarget": cli.retarget.main,
    "dance-inspect": cli.inspect.main,
    "dance-report": cli.report.main,
    "dance-compare": cli.compare.main,
    "dance-train": cli.train.main,
    "dance-eval": cli.evaluate.main,
    "dance-play": cli.play.main,
    "dance-view": cli.view.main,
    "dance-convert": cli.convert.main,
    "dance-verify": cli.verify.main,
    "dance-doctor": cli.doctor.main,
    "dance-certify": cli.certify.main,
    "dance-export": cli.export.main,
    "dance-deploy": cli.deploy.main,
    "dance-robot": cli.robot.main,
}


@pytest.mark.parametrize("name", COMMANDS)
def test_help_has_an_example_and_an_unknown_option_is_refused(name, capsys):
    with pytest.raises(SystemExit) as e:
        COMMANDS[name](["--help"])
    assert e.value.code == 0
    assert f"{name} " in capsys.readouterr().out
    with pytest.raises(SystemExit) as e:
        COMMANDS[name](["--no-such-option"])
    assert e.value.code == 2


def test_retarget_writes_reference_and_recording(tmp_path, capsys):
    out = tmp_path / "g.npz"
    code = COMMANDS["dance-retarget"]([str(SAMPLES / "groove.csv"), "-o", str(out), "--end", "2"])
    said = capsys.readouterr().out
    assert code == 0, said
    assert out.exists() and out.with_suffix(".rrd").stat().st_size > 100_000
    assert "every gate holds" in said and str(out) in said
    assert {p.suffix for p in tmp_path.iterdir()} == {".npz", ".rrd"}


def test_a_loop_tells_its_seam(tmp_path, capsys):
    words = [
        str(SAMPLES / "groove.bvh"),
        "-o",
        str(tmp_path / "l.npz"),
        "--end",
        "1.5",
        "--loop",
        "2",
        "--no-recording",
    ]
    assert COMMANDS["dance-retarget"](words) == 0
    assert "seam at" in capsys.readouterr().out


@pytest.mark.parametrize(
    "words",
    [
        ["--loop", "0"],
        ["--loop", "2", "--fit-dynamics"],
        ["--loop", "2", "--write-contacts", "c.csv"],
        ["--fit-dynamics", "--write-contacts", "c.csv"],
    ],
)
def test_options_that_would_be_ignored_together_are_refused(words, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert COMMANDS["dance-retarget"]([str(SAMPLES / "groove.bvh"), *words]) == 2
    assert "found" in capsys.readouterr().err and not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", ["dance-retarget", "dance-report", "dance-compare"])
def test_a_command_without_any_file_is_refused(name, capsys):
    assert COMMANDS[name]([]) == 2
    assert "no file named" in capsys.readouterr().err


def test_a_recording_is_no_reference_and_the_way_to_it_is_told(tmp_path, capsys):
    (tmp_path / "a.rrd").write_bytes(b"RRF2" + bytes(40))
    assert COMMANDS["dance-train"](["--ref", str(tmp_path / "a.rrd")]) == 2
    assert "the reference (.npz) that was written beside it" in capsys.readouterr().err


def test_a_refused_file_costs_two_lines_exit_code_2_and_no_output(tmp_path, capsys):
    np.savetxt(tmp_path / "m.csv", np.tile([0, 0, 0.79, 0, 0, 0, 1, *np.zeros(29)], (30, 1)), delimiter=",")
    words = [str(tmp_path / "m.csv"), "-o", str(tmp_path / "out.npz")]
    assert COMMANDS["dance-retarget"](words) == 2
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 2 and lines[0].startswith("refused: m.csv") and lines[1] == "see: dance-retarget --help, --fps"
    assert not (tmp_path / "out.npz").exists()


def test_a_reference_below_the_gate_is_exit_code_1(tmp_path, monkeypatch):
    from retarget import Gates, RetargetConfig

    monkeypatch.setattr("cli.retargeting.arguments.RetargetConfig", lambda: RetargetConfig(gates=Gates(slide_mm=0.0)))
    words = [str(SAMPLES / "groove.csv"), "-o", str(tmp_path / "o.npz"), "--end", "1.5", "--no-recording"]
    assert COMMANDS["dance-retarget"](words) == 1


def test_a_missing_folder_is_made_and_one_that_cannot_be_is_one_line(tmp_path, capsys):
    (tmp_path / "file").write_text("")
    for folder, code in (("new/one", 0), ("file", 2)):
        words = [str(SAMPLES / "groove.csv"), "-o", str(tmp_path / folder / "o.npz"), "--end", "1", "--no-recording"]
        assert COMMANDS["dance-retarget"](words) == code
    assert (tmp_path / "new/one/o.npz").is_file() and "takes no file" in capsys.readouterr().err


def test_inspect_tells_what_and_why(capsys):
    assert COMMANDS["dance-inspect"]([str(SAMPLES / "groove.bvh")]) == 0
    said = capsys.readouterr().out
    for word in ("BVH", "60", "Frame Time", "up axis", "--up", "cm", "left_knee = LeftLeg", "right-handed"):
        assert word in said, word


def test_train_and_eval_from_end_to_end(groove_file, tmp_path, capsys):
    pytest.importorskip("torch")
    run = tmp_path / "run"
    words = [
        "--ref",
        str(groove_file),
        "-o",
        str(run),
        "--steps",
        "6144",
        "--envs",
        "64",
        "--threads",
        "1",
        "--teacher",
        "none",
    ]
    assert COMMANDS["dance-train"](words) in (0, 1)
    said = capsys.readouterr().out
    assert "survives" in said and "% of rollouts finish" in said
    assert (run / "training.rrd").stat().st_size > 50_000
    result = tmp_path / "result.json"
    code = COMMANDS["dance-eval"]([str(run), "--rollouts", "4", "--json", str(result)])
    told = json.loads(result.read_text())["results"]["mujoco"]
    assert code == (0 if told["finished"] >= 0.95 else 1)
    assert told["rollouts"] == 4 and told["survived_s"] > 0
    capsys.readouterr()
    assert COMMANDS["dance-train"](words) == 2  # the run is there already
    assert "--resume" in capsys.readouterr().err


def test_eval_refuses_another_reference(groove_file, tmp_path, capsys):
    told = json.loads((ROOT / "tracking/policies/groove-dancer/contract.json").read_text())
    (tmp_path / "contract.json").write_text(json.dumps({**told, "reference_sha256": "0" * 64}))
    assert COMMANDS["dance-eval"]([str(tmp_path), "--ref", str(groove_file)]) == 2
    assert "contract, reference_sha256" in capsys.readouterr().err


DOCUMENTS = [*sorted(ROOT.glob("*.md")), *sorted(ROOT.rglob("docs/**/*.md")), *sorted(ROOT.glob("benchmarks/*.md"))]


def commands_in(text):
    """Lines of our commands in a document's blocks of shell, and in its inline code where a whole command stands."""
    blocks = re.findall(r"```(?:bash|sh|console)\n(.*?)```", text, re.S)
    lines = [line for block in blocks for line in block.replace("\\\n", " ").splitlines()]
    return [m.group(1) for line in lines if (m := re.match(r"\s*(?:\$ )?(dance-[a-z]+ .*)$", line))]


def parses(line):
    import inspect as python

    words = shlex.split(line.split(" #")[0].split("   #")[0])
    words = words[: words.index("|")] if "|" in words else words
    parse(python.getmodule(COMMANDS[words[0]]).Arguments, words[1:], words[0])


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_every_command_in_the_documents_parses(path):
    lines = commands_in(path.read_text(encoding="utf-8"))
    assert len(lines) >= {"README.md": 2, "README.zh-CN.md": 2, "commands.md": 20}.get(path.name, 0)
    for line in lines:
        parses(line)


def test_every_command_that_is_proposed_parses(groove_file, tmp_path, monkeypatch):
    """What verdicts propose, good and bad, can be typed."""
    from retarget import Gates, RetargetConfig

    monkeypatch.chdir(tmp_path)
    (tmp_path / "g.npz").write_bytes(groove_file.read_bytes())
    (tmp_path / "clips").mkdir()
    for name in ("groove.bvh", "groove.csv"):
        (tmp_path / "clips" / name).write_bytes((SAMPLES / name).read_bytes())
    lines = [
        "dance-retarget clips/groove.bvh --end 1.5 -o a.npz", "dance-inspect clips/groove.csv", "dance-report g.npz",
        "dance-compare g.npz a.npz --recording c.rrd", "dance-verify g.npz", "dance-convert g.npz --to phc",
        "dance-train --ref g.npz --check-ref", "dance-eval groove-dancer --rollouts 2",
        "dance-export groove-dancer -o bundle", "dance-robot list", "dance-retarget clips -o refs --jobs 1 --lead-in 0.5",
    ]  # fmt: skip
    proposed = []
    for k, line in enumerate([*lines, *lines[:1]]):
        if k == len(lines):  # once more, with a gate that nothing holds
            monkeypatch.setattr(
                "cli.retargeting.arguments.RetargetConfig", lambda: RetargetConfig(gates=Gates(slide_mm=0.0))
            )
        words = shlex.split(line)
        assert COMMANDS[words[0]]([*words[1:], "--json", "v.json"]) in (0, 1)
        told = json.loads((tmp_path / "v.json").read_text())
        proposed += [step["command"] for step in told["next"]]
        proposed += [cure["command"] for trouble in told["troubles"] for cure in trouble["cures"] if cure["command"]]
    ours = [command for command in proposed if command.startswith("dance-")]
    assert len(ours) > 12 and all(c.startswith(("dance-", "rerun ", "pip ")) for c in proposed)
    for command in ours:
        parses(command)


TRANSLATED = [path for path in DOCUMENTS if path.name.endswith(".zh-CN.md")]


@pytest.mark.parametrize("path", TRANSLATED, ids=lambda path: str(path.relative_to(ROOT)))
def test_a_translation_shows_the_same_commands_sections_and_rows(path):
    found = []
    for file in (path, path.with_name(path.name.replace(".zh-CN", ""))):
        text = file.read_text(encoding="utf-8")
        blocks = re.findall(r"```bash\n(.*?)```", text, re.S)
        lines = [re.sub(r"\s*#.*", "", line).strip() for b in blocks for line in b.splitlines() if line.strip()]
        found.append(
            (lines, len(re.findall(r"^#+ ", re.sub(r"```.*?```", "", text, flags=re.S), re.M)), text.count("\n|"))
        )
    assert found[0] == found[1]
    assert len(TRANSLATED) >= 9


def test_an_output_of_another_kind_is_refused(tmp_path, capsys):
    assert COMMANDS["dance-retarget"]([str(SAMPLES / "groove.csv"), "-o", str(tmp_path / "o.rrd")]) == 2
    assert "ends in .npz" in capsys.readouterr().err


def test_inspect_describes_a_file_that_does_not_say_its_rate(tmp_path, capsys):
    from robot_models import load_robot

    pose = load_robot("g1").default_qpos
    np.savetxt(tmp_path / "m.csv", np.tile(pose, (30, 1)), delimiter=",")
    assert COMMANDS["dance-inspect"]([str(tmp_path / "m.csv"), "--quat-order", "wxyz"]) == 1
    said = capsys.readouterr().out
    assert "does not say its rate" in said and "--fps" in said


def test_links_in_the_documents_lead_somewhere():
    for path in [*ROOT.glob("*.md"), *ROOT.glob("docs/*.md")]:
        for link in re.findall(r"\]\(([^)#:]+)\)", path.read_text(encoding="utf-8")):
            assert (path.parent / link).exists(), f"{path.name}: {link}"


def test_examples_in_the_help_parse(capsys):
    import inspect as python

    for name, main in COMMANDS.items():
        arguments = python.getmodule(main).Arguments
        examples = [line.strip() for line in arguments.__doc__.splitlines() if line.split()[:1] == [name]]
        assert examples, name
        for line in examples:
            parse(arguments, shlex.split(line)[1:], name)
