"""The locks say what the tested set says, every pin with its hashes; the bill of materials lists the same."""

import json
import re

import pytest
from conftest import ROOT

LOCKS = sorted((ROOT / "locks").glob("py*.txt"))
PIN = re.compile(
    r"^([A-Za-z0-9_.-]+)==([^ \n]+)(?: ;[^\n]*)? \\\n((?:    --hash=sha256:[0-9a-f]{64}(?: \\)?\n?)+)", re.MULTILINE
)


def pins(text):
    return {name.lower().replace("_", "-"): version for name, version, _ in PIN.findall(text)}


def bare(version):
    return version.partition("+")[0]  # a build of torch is named behind a plus


@pytest.mark.parametrize("path", LOCKS, ids=lambda p: p.stem)
def test_every_pin_has_hashes_and_is_the_tested_one(path):
    text = path.read_text()
    locked = pins(text)
    assert len(locked) > 80 and len(locked) == len(re.findall(r"^[A-Za-z0-9_.-]+==", text, re.MULTILINE))
    tested = dict(
        line.lower().replace("_", "-").split("==")
        for line in (ROOT / "tested-versions.txt").read_text().splitlines()
        if "==" in line and not line.startswith("#")
    )
    apart = {n: (v, tested[n]) for n, v in locked.items() if n in tested and bare(v) != bare(tested[n].split()[0])}
    assert not apart
    assert "http" not in text.partition("==")[2]


def test_the_bill_of_materials_lists_the_same():
    listed = json.loads((ROOT / "locks" / "sbom.cdx.json").read_text())["components"]
    assert {c["name"].lower().replace("_", "-") for c in listed} == set(
        pins((ROOT / "locks" / "py311.txt").read_text())
    )
