"""Where a clip came from: text in any encoding, a record that only grows; impossible options are refused."""

import hashlib
from pathlib import Path

import pytest
from stick_person import SOURCE

from clips import ClipError, Finding, ReadOptions, Repair
from clips.provenance import FASTEST, SLOWEST, UNITS, RawFile
from robot_models.incoming import MAX_FILE

TEXT = "名称,左膝\n1,2\n"


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "gb18030", "utf-16"])
def test_text_is_the_same_in_every_encoding(encoding):
    raw = RawFile(path=Path("t.csv"), data=TEXT.encode(encoding))
    assert raw.text() == TEXT
    assert encoding == "utf-16" or not raw.head.startswith(b"\xef\xbb\xbf")  # the mark is no part of the head


def test_bytes_that_are_no_text_are_refused_by_name():
    with pytest.raises(ClipError, match=r"t\.csv: found bytes that are no text"):
        RawFile(path=Path("folder/t.csv"), data=b"\xff\xff\xff").text()


def test_a_files_record_is_its_name_and_the_hash_of_its_bytes_and_not_where_it_lay(tmp_path):
    sources = []
    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "x.bvh").write_bytes(b"HIERARCHY")
        sources.append(RawFile.load(tmp_path / folder / "x.bvh").source("bvh", []))
    assert sources[0] == sources[1]
    assert (sources[0].file, sources[0].sha256) == ("x.bvh", hashlib.sha256(b"HIERARCHY").hexdigest())


def test_what_is_no_file_is_refused(tmp_path):
    (tmp_path / "empty").touch()
    with open(tmp_path / "huge", "wb") as stream:  # a hole: it takes no room on the disk
        stream.truncate(MAX_FILE + 1)
    for path, said in (
        ("empty", "found 0 bytes"),
        ("huge", f"found {MAX_FILE + 1} bytes"),
        ("no", "no such file"),
        (".", "a folder"),
    ):
        with pytest.raises(ClipError, match=said):
            RawFile.load(tmp_path / path)


def test_records_grow_at_the_end_and_leave_the_old_one_alone():
    repair = Repair(what="w", count=2)
    longer = SOURCE.noting("first", "second").noting("third").mended(repair)
    assert longer.conversions == ("first", "second", "third") and longer.repairs == (repair,)
    assert SOURCE.conversions == () == SOURCE.repairs and longer.sha256 == SOURCE.sha256


def test_findings_and_repairs_read_as_sentences_with_their_evidence():
    finding = Finding(what="unit", value="cm", why="legs of 80", confidence="measured")
    assert str(finding) == "unit: cm (measured: legs of 80)"
    assert str(Repair(what="filled", count=3, of="samples", where="at 1 s")) == "filled: 3 samples, at 1 s"
    assert str(Repair(what="filled", count=3)) == "filled: 3 frames"


@pytest.mark.parametrize(
    "options",
    [
        {"fps": 0.0}, {"fps": float("nan")}, {"fps": FASTEST * 2}, {"up": "w"}, {"up": "Z"}, {"unit": "furlong"}, {"unit": "0"},
        {"unit": "-1"}, {"unit": "nan"}, {"unit": "inf"}, {"stature": 170.0}, {"stature": 0.0}, {"stature": float("nan")},
        {"quat_order": "xyzy"}, {"joint_order": "alphabetical"},
    ],
)  # fmt: skip
def test_an_option_that_cannot_be_is_refused_by_its_name(options):
    ((name, value),) = options.items()
    with pytest.raises(ClipError, match=f"option {name}: found ") as refusal:
        ReadOptions(**options)
    assert refusal.value.option == name and repr(value) in str(refusal.value)


def test_options_that_can_be_are_taken():
    for unit in (*UNITS, "0.3", "1e-3"):
        assert ReadOptions(unit=unit).unit == unit
    for fps in (SLOWEST, FASTEST, 29.97):
        assert ReadOptions(fps=fps).fps == fps
    assert all(v is None for v in vars(ReadOptions()).values())


def test_a_unit_is_what_the_international_inch_and_cmus_files_say():
    assert UNITS["cmu"] * 0.45 == pytest.approx(UNITS["inch"]) and UNITS["inch"] == pytest.approx(2.54 * UNITS["cm"])
    assert UNITS["m"] == pytest.approx(100 * UNITS["cm"]) and UNITS["cm"] == pytest.approx(10 * UNITS["mm"])


@pytest.mark.parametrize(
    ("fps", "good"), [(SLOWEST, True), (FASTEST, True), (0.99, False), (2000.1, False), (float("nan"), False)]
)
def test_the_rates_of_recordings_have_two_ends(fps, good):
    raw = RawFile(path=Path("t.csv"), data=b"x")
    if good:
        raw.check_rate(fps)
        return
    with pytest.raises(ClipError, match="frames per second") as refusal:
        raw.check_rate(fps)
    assert (refusal.value.option, raw.no_fps().option) == ("fps", "fps")
