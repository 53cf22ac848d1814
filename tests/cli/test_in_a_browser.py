"""The pages in a real browser: they load, play, mend, push and tell; a file on disk fetches nothing. Where there is a Chromium."""

import os
import re
import shutil
import signal
import subprocess
import sys
import time
from contextlib import contextmanager

import pytest
from browser import Browser, needs_browser
from conftest import SAMPLES, SHARED

pytest.importorskip("viser")
pytestmark = [needs_browser, pytest.mark.slow]


@contextmanager
def served(folder, command, *words):
    """A command that serves a page; its address."""
    code = f"import sys; from cli.{command} import main; sys.exit(main({list(map(str, words))!r}))"
    process = subprocess.Popen(
        [sys.executable, "-c", code], cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
        env={**os.environ, "DISPLAY": "", "PYTHONUNBUFFERED": "1"},
    )  # fmt: skip
    said = []
    try:
        for line in process.stdout:
            said.append(line)
            found = re.search(r"http://localhost:\d+", line)
            if found:
                break
        else:
            raise AssertionError("".join(said))
        yield found.group(0)
    finally:
        process.send_signal(signal.SIGTERM)
        process.wait(60)
        process.stdout.close()


@pytest.fixture
def folder(tmp_path):
    shutil.copy(SAMPLES / "groove.csv", tmp_path)
    return tmp_path


def seconds(page):
    return float(page.js("[...document.querySelectorAll('input')].map(e => e.value).find(v => /^[0-9.]+$/.test(v))"))


def test_a_recording_plays_is_mended_and_its_command_writes_the_same_bytes(folder):
    with served(folder, "view", "groove.csv", "--robot", "dancer", "--port", 8410) as address, Browser(address) as page:
        page.wait("every gate holds")
        first = seconds(page)
        time.sleep(1.5)
        assert seconds(page) != first  # it plays
        page.click("pause")
        page.wait("play")
        held = seconds(page)
        time.sleep(0.7)
        assert seconds(page) == held
        page.js("[...document.querySelectorAll('input[type=checkbox]')].at(-1).click()")
        page.click("solve again")
        page.wait("every gate holds before, every gate holds now")
        page.click("write reference, recording and CSVs here")
        page.wait("wrote groove_dancer.npz")
        command = page.js("document.querySelector('code').innerText")
    ours = (folder / "groove_dancer.npz").read_bytes()
    (folder / "groove_dancer.npz").unlink()
    name, *words = command.split()
    assert name == "dance-retarget"
    code = f"import sys; from cli.retarget import main; sys.exit(main({words!r}))"
    assert subprocess.run([sys.executable, "-c", code], cwd=folder, capture_output=True).returncode == 0
    assert (folder / "groove_dancer.npz").read_bytes() == ours


def dropped(page, file):
    """What a file does that is dropped on the page's button."""
    root = page.ask("DOM.getDocument", depth=-1)["root"]["nodeId"]
    button = page.ask("DOM.querySelector", nodeId=root, selector="input[type=file]")["nodeId"]
    page.ask("DOM.setFileInputFiles", nodeId=button, files=[str(file)])


def test_a_recording_is_dropped_on_the_page_refused_without_its_rate_and_danced_with_physics(tmp_path):
    pytest.importorskip("torch")
    tracker = SHARED.parent / "policies" / "twist2_1017_20k.onnx"
    clip, bare = SHARED / "bvh" / "fair1_dab.bvh", SHARED / "csv" / "g1moves_tiktok.csv"
    if not (tracker.exists() and clip.exists()):
        pytest.skip("no shared clips")
    words = ["--robot", "g1", "--tracker", tracker, "--port", 8430]
    with served(tmp_path, "view", *words) as address, Browser(address) as page:
        page.wait("drop a recording here")
        dropped(page, bare)
        page.wait("state it above: --fps")
        dropped(page, clip)
        page.wait("every gate holds")
        assert "dance-retarget fair1_dab.bvh --robot g1" in page.text
        page.click("dance it with physics")
        page.wait("mm off; falls")
        page.click("back to mending")
        page.wait("solve again")
    assert (tmp_path / "fair1_dab.bvh").read_bytes() == clip.read_bytes()


def test_a_policy_dances_and_falls_where_it_is_pushed_hard(folder):
    pytest.importorskip("torch")
    with served(folder, "view", "groove-dancer", "--port", 8420) as address, Browser(address) as page:
        page.wait("mm off; falls: 0")
        for _ in range(12):
            page.click("▲")
        page.wait("js:/falls: [1-9]/.test(document.body.innerText)", 60)


def test_a_training_is_looked_at_while_it_learns(folder, groove_file):
    pytest.importorskip("torch")
    words = [
        "--ref",
        groove_file,
        "-o",
        "run",
        "--view",
        "--envs",
        32,
        "--steps",
        200_000,
        "--minutes",
        3,
        "--threads",
        1,
    ]
    with served(folder, "train", *words, "--teacher", "none", "--no-recording") as address, Browser(address) as page:
        page.wait("learning", 60)
        page.wait("% finish", 90)
        page.wait("robots fail")


def test_a_page_on_disk_plays_without_a_network_and_fetches_nothing(folder, groove_file):
    code = f"import sys; from cli.view import main; sys.exit(main([{str(groove_file)!r}, '--web', 'dance.html']))"
    assert subprocess.run([sys.executable, "-c", code], cwd=folder, capture_output=True).returncode == 0
    with Browser((folder / "dance.html").as_uri(), network=False) as page:
        page.wait("every gate holds")
        page.wait("left heel")
        time.sleep(3.0)
        page.js("1")
        assert not [url for url in page.fetched if url.startswith(("http", "ws"))], page.fetched
        assert page.picture(folder / "page.png").stat().st_size > 10_000


def test_a_policys_page_has_its_physics_and_does_what_python_does(folder):
    pytest.importorskip("torch")
    from tracking.playground import BUILT

    if not (BUILT / "playground.js").exists():
        pytest.skip("make web")
    code = "import sys; from cli.export import main; sys.exit(main(['groove-g1', '--web', 'g1.html']))"
    assert subprocess.run([sys.executable, "-c", code], cwd=folder, capture_output=True).returncode == 0
    with Browser((folder / "g1.html").as_uri(), network=False) as page:
        told = page.wait("js:(document.getElementById('golden').textContent.match(/to ([0-9.e-]+)$/) || [])[1]")
        assert "✓" in page.text and float(told) < 1e-4
        assert page.wait("js:window.dance && parseFloat(document.getElementById('time').textContent) > 0.1")
        danced, falls = page.js(_DANCED.replace("PUSH", "0"))
        assert (danced, falls) == (12.6, 0)  # to its end
        danced, falls = page.js(_DANCED.replace("PUSH", "1.5"))
        assert falls == 1 and 5.0 < danced < 7.0  # the control: pushed in second 5
        page.click("▲")
        assert not [url for url in page.fetched if url.startswith(("http", "ws"))], page.fetched


_DANCED = """(() => {
  const show = window.dance;
  [show.playing, show.falls] = [false, 0];
  show.begin();
  let k = 0;
  for (; show.policy.frame < show.policy.motion.frames - 1 && show.falls === 0; k++) {
    if (k === 250) show.robot.push(PUSH, 0);
    show.advance();
  }
  return [k * 0.02, show.falls];
})()"""
