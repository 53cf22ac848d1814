"""`dance-retarget FOLDER`: what counts as a batch, what is refused of it, and what its verdicts come to."""

import csv
from pathlib import Path

import pytest

import cli.retargeting.batch
from cli.retarget import main
from cli.retargeting import Arguments, is_batch
from retarget.workflows.batch import Outcome


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "clips").mkdir()
    for name in ("a.bvh", "b.bvh"):
        (tmp_path / "clips" / name).write_text("x")
    return tmp_path


@pytest.fixture
def verdicts(monkeypatch):
    """Outcomes as they are given here, without any retargeting."""

    def give(*said, **more):
        seen = []

        def outcomes(jobs, config, args):
            seen.append((jobs, config))
            for job, verdict in zip(jobs[::-1], said, strict=True):  # not in the order of the jobs
                yield Outcome(clip=str(job.clip), robot=job.robot, key="k", verdict=verdict, **more)

        monkeypatch.setattr(cli.retargeting.batch, "_outcomes", outcomes)
        return seen

    return give


@pytest.mark.parametrize(
    ("name", "batch"),
    [
        ("clips", True),
        ("clips/*.bvh", True),
        ("**/a.bvh", True),
        ("clips/a.bvh", False),
        ("absent.bvh", False),
        ("take[1].bvh", False),
    ],
)
def test_folders_and_patterns_are_batches_and_a_file_with_brackets_in_its_name_is_a_file(folder, name, batch):
    (folder / "take[1].bvh").write_text("x")
    assert is_batch(Arguments(clips=(Path(name),))) is batch
    assert is_batch(Arguments(clips=(Path(name), Path("other.bvh")))) and is_batch(
        Arguments(clips=(Path(name),), robot="g1,dancer")
    )


@pytest.mark.parametrize(
    ("said", "code"),
    [
        (("keep", "keep"), 0),
        (("keep", "down-weight"), 0),
        (("keep", "quarantine"), 1),
        (("keep", "exclude"), 3),
        (("quarantine", "exclude"), 1),
        (("quarantine", "quarantine"), 1),
        (("exclude", "exclude"), 2),
    ],
)
def test_the_worst_of_the_verdicts_decides_the_exit_code(folder, verdicts, capsys, said, code):
    verdicts(*said, message="because")
    assert main(["clips", "-o", "out"]) == code
    out = capsys.readouterr().out
    written = sum(v != "exclude" for v in said)
    assert f"{written} references in out" in out and "wrote out/summary.csv" in out
    with open(folder / "out" / "summary.csv", newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert [row["clip"] for row in rows] == ["clips/a.bvh", "clips/b.bvh"]  # in order, however they came
    assert [row["verdict"] for row in rows] == list(said[::-1])


def test_every_clip_meets_every_robot_and_options_reach_the_work(folder, verdicts):
    seen = verdicts(*["keep"] * 4)
    words = [
        "clips",
        "-o",
        "out",
        "--robot",
        "g1,dancer",
        "--out-fps",
        "25",
        "--lead-in",
        "0.25",
        "--fps",
        "60",
        "--strict",
    ]
    assert main(words) == 0
    ((jobs, config),) = seen
    assert {(job.clip.name, job.robot) for job in jobs} == {
        (c, r) for c in ("a.bvh", "b.bvh") for r in ("g1", "dancer")
    }
    assert (config.retargeting.fps, config.retargeting.lead_in_s, config.reading.fps, config.strict) == (
        25.0,
        0.25,
        60.0,
        True,
    )


def test_a_pattern_takes_what_matches_it_and_results_go_to_a_folder_of_their_own_by_default(folder, verdicts):
    seen = verdicts("keep")
    assert main(["clips/a*.bvh"]) == 0
    assert [job.clip.name for job in seen[0][0]] == ["a.bvh"] and (folder / "references" / "summary.csv").exists()


def test_a_clip_below_a_gate_has_its_own_command_which_puts_it_back(folder, verdicts, capsys):
    verdicts("quarantine", "keep", reference="out/x_dancer.npz", failed=("deepest self-collision",))
    assert main(["clips", "-o", "out"]) == 1
    out = capsys.readouterr().out
    assert out.count("dance-retarget clips/b.bvh --robot dancer -o out/x_dancer.npz") == 1


def test_why_a_clip_was_left_out_is_said_of_that_clip(folder, verdicts, capsys):
    verdicts("exclude", "quarantine", message="torn [in] two", failed=())
    main(["clips", "-o", "out", "--verbose"])
    out = capsys.readouterr().out
    assert "exclude: b.bvh on dancer: torn [in] two" in out and "quarantine: a.bvh on dancer: torn [in] two" in out


def test_several_files_and_folders_on_one_line_are_each_taken_once_and_troubles_are_counted(folder, verdicts, capsys):
    (folder / "more").mkdir()
    (folder / "more" / "a.bvh").write_text("x")
    seen = verdicts("exclude", "exclude", "keep", message="torn")
    assert main(["clips", "more", "clips/a.bvh", "-o", "out"]) == 3
    assert [str(job.clip) for job in seen[0][0]] == ["clips/a.bvh", "clips/b.bvh", "more/a.bvh"]
    assert {job.out.name for job in seen[0][0]} == {"clips_a_bvh_dancer.npz", "b_dancer.npz", "more_a_bvh_dancer.npz"}
    assert "2 x refused: torn: " in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--start", "1"], "--start"),
        (["--end", "2"], "--end"),
        (["--mirror"], "--mirror"),
        (["--drop", "1-2"], "--drop"),
        (["--speed", "2"], "--speed"),
        (["--loop", "2", "--fit-dynamics"], "--loop, --fit-dynamics"),
        (["--contacts", "c.csv", "--keys", "k.csv"], "--contacts, --keys"),
        (["--ray", "auto", "--jobs", "2"], "--jobs"),
        (["-o", "clips"], "the folder of the clips"),
        (["-o", "clips/a.bvh"], "no folder"),
    ],
)
def test_what_means_one_clip_or_would_mix_results_with_clips_is_refused(folder, verdicts, capsys, words, said):
    seen = verdicts()
    assert main(["clips", *words]) == 2
    assert said in capsys.readouterr().err and not seen
    assert sorted(p.name for p in folder.rglob("*")) == ["a.bvh", "b.bvh", "clips"]


@pytest.mark.parametrize("what", ["empty", "none-*.bvh"])
def test_nothing_to_do_is_refused(folder, verdicts, capsys, what):
    (folder / "empty").mkdir()
    (folder / "empty" / "notes.md").write_text("x")
    verdicts()
    assert main([what]) == 2
    assert "no motion file" in capsys.readouterr().err and not (folder / "references").exists()
