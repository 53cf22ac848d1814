"""Certificates: counts that add up, an interval as narrow as asked for, and a file that holds for its own bundle alone."""

import dataclasses
import json
import shutil
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("onnxruntime")

import cli.certify
import tracking
import tracking.evaluation.certificate as module
from cli.recordings import certificate_page
from tracking import TrackingError
from tracking.evaluation import CERTIFICATE, certify, read_certificate, write_certificate
from tracking.evaluation.certificate import Share

pytestmark = pytest.mark.usefixtures("as_users_run_it")

DANCER = Path(tracking.__file__).parent / "policies" / "groove-dancer"


@pytest.fixture
def bundle(tmp_path):
    shutil.copytree(DANCER, tmp_path / "bundle")
    return tmp_path / "bundle"


def small(**changes):
    hashes = module._hashes(DANCER)
    late = module.Tried(
        condition="delay 10 ms", engine="mujoco", finished=Share(count=9, of=10), stood=Share(count=10, of=10)
    )  # fmt: skip
    told = dict(
        robot="dancer", robot_hash="h", dance_s=10.0, finished=Share(count=95, of=100), fell=Share(count=3, of=100),
        strayed=Share(count=2, of=100), hardest=((4.0, 3), (9.0, 2)),
        tried=(late,),
        not_tried=("a real robot",), sha256=hashes, versions={"numpy": "2"}, seed=1, minutes=0.1,
    )  # fmt: skip
    return module.Certificate(**(told | changes))


class Rolled:
    """Evaluations by a coin of known bias."""

    def __init__(self, share):
        self.share, self.rng, self.seeds = share, np.random.default_rng(0), []

    def __call__(self, runner, robot, reference, config, *, rollouts, seed):
        self.seeds.append(seed)
        good = float((self.rng.random(rollouts) < self.share).mean())
        return module.Evaluation(
            rollouts=rollouts, finished=good, finished_low=0.0, finished_high=1.0, finished_in_place=good, survived_s=9.0,
            stood=1.0, stood_s=10.0, duration_s=10.0, body_error_mm=1.0, body_error_half_mm=0.1, global_error_mm=1.0,
            joint_error_rad=0.1, causes={}, terms={}, seconds=(), shown={},
        )  # fmt: skip


@pytest.mark.parametrize(("share", "half_width"), [(0.96, 0.02), (0.5, 0.05), (1.0, 0.01)])
def test_rollouts_go_on_until_the_share_is_known_and_every_round_has_robots_of_its_own(
    bundle, monkeypatch, share, half_width
):
    rolled = Rolled(share)
    monkeypatch.setattr(module, "evaluate", rolled)
    monkeypatch.setattr(module, "sweep", lambda *_, **__: [])
    got = certify(bundle, half_width=half_width, each=50)
    low, high = got.finished.interval
    assert high - low <= 2.0 * half_width and abs(got.finished.count / got.finished.of - share) < 3.0 * half_width
    assert len(set(rolled.seeds)) == len(rolled.seeds) == got.finished.of // 50
    assert got.finished.count + got.fell.count + got.strayed.count == got.finished.of
    before = got.finished.of - 50
    if before:
        assert np.diff(module.wilson(round(share * before), before))[0] > 1.6 * half_width  # no more than were needed


def test_the_most_rollouts_end_it_too(bundle, monkeypatch):
    monkeypatch.setattr(module, "evaluate", Rolled(0.5))
    monkeypatch.setattr(module, "sweep", lambda *_, **__: [])
    assert certify(bundle, half_width=0.001, each=50, most=200).finished.of == 200


def test_it_survives_its_file_and_holds_for_its_own_bundle_alone(bundle):
    ours = small()
    write_certificate(bundle / CERTIFICATE, ours)
    assert read_certificate(bundle) == ours
    assert read_certificate(DANCER) is None
    for name in ("policy.onnx", "contract.json", "reference.npz", "golden.npz"):
        kept = (bundle / name).read_bytes()
        (bundle / name).write_bytes(kept + b" ")
        with pytest.raises(TrackingError, match=f"another {name}"):
            read_certificate(bundle)
        (bundle / name).unlink()
        with pytest.raises(TrackingError, match=f"another {name}"):
            read_certificate(bundle)
        (bundle / name).write_bytes(kept)
    assert read_certificate(bundle) == ours


@pytest.mark.parametrize(
    "change",
    [
        {"format": 2}, {"finished": 3}, {"finished": {"count": 1, "of": 0}}, {"finished": {"count": 500, "of": 100}},
        {"fell": {"count": -1, "of": 10}}, {"tried": [{}]}, {"sha256": None}, {"more": 1}, {"hardest": ["x"]},
        {"finished": {"count": "a", "of": "b"}},
    ],
)  # fmt: skip
def test_what_is_no_certificate_is_refused(bundle, change):
    write_certificate(bundle / CERTIFICATE, small())
    told = json.loads((bundle / CERTIFICATE).read_text()) | change
    (bundle / CERTIFICATE).write_text(json.dumps(told))
    with pytest.raises(TrackingError):
        read_certificate(bundle)


def test_the_page_tells_all_of_it_and_runs_nothing_that_stands_in_a_name():
    page = certificate_page("<script>alert(1)</script>", small(not_tried=("<b>", "a\x1b[2J")))
    assert "95.0 %" in page and "delay 10 ms" in page and "a real robot" not in page
    assert "<script>" not in page and "&lt;b&gt;" in page and "\x1b" not in page
    for name, value in small().sha256.items():
        assert name in page and value in page


def test_who_is_about_to_run_it_hears_how_often_it_falls_and_what_nobody_tried():
    text = "\n".join(dataclasses.replace(small()).lines())
    assert "95.0 % of 100" in text and "3.0 % of 100" in text and "90 % at 10 ms" in text and "a real robot" in text


@pytest.mark.slow
def test_a_certificate_of_the_dancer_from_the_command(bundle, capsys):
    assert cli.certify.main([str(bundle), "--half-width", "0.1", "--each", "10", "--jobs", "1"]) in (0, 1)
    assert read_certificate(bundle) is not None and (bundle / "certificate.html").exists()
    assert "finishes" in capsys.readouterr().out
