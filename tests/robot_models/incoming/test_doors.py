"""The doors: regular files, archives that unpack to what they say, harmless names and patterns, children that end."""

import io
import os
import time
import zipfile

import numpy as np
import pytest

from robot_models import DanceError, RobotError
from robot_models.incoming import (
    MAX_NAME,
    check_pattern,
    file_name,
    parsed,
    printable,
    read_arrays,
    read_bytes,
    read_text,
    refusal_of_child,
)
from robot_models.incoming import limits as table


def test_a_pipe_a_device_and_a_folder_are_no_files_and_nobody_waits_for_them(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "link").symlink_to(tmp_path / "pipe")
    began = time.monotonic()
    for path, said in ((tmp_path / "pipe", "pipe"), (tmp_path / "link", "pipe"), (tmp_path, "folder")):
        with pytest.raises(RobotError, match=said):
            read_bytes(path, expected="x", error=RobotError)
    for path in ("/dev/zero", "/dev/stdin", "no\0name", "x" * 5000):
        with pytest.raises(DanceError):
            read_bytes(type(tmp_path)(path), expected="x")
    assert time.monotonic() - began < 2.0


def test_a_file_of_the_most_bytes_passes_and_one_more_does_not(tmp_path):
    (tmp_path / "a").write_bytes(b"x" * 100)
    assert read_bytes(tmp_path / "a", expected="x", most=100) == b"x" * 100
    with pytest.raises(DanceError, match="100 bytes"):
        read_bytes(tmp_path / "a", expected="x", most=99)


def test_what_grows_while_it_is_read_does_not_fill_the_memory(tmp_path, monkeypatch):
    (tmp_path / "a").write_bytes(b"x" * 100)
    import robot_models.incoming.files as module

    monkeypatch.setattr(module, "regular_file", lambda path, **_: path)  # it was small when it was looked at
    with pytest.raises(DanceError, match="over 50"):
        module.read_bytes(tmp_path / "a", expected="x", most=50)


def test_text_is_utf_8_or_refused(tmp_path):
    (tmp_path / "a").write_bytes("踊".encode())
    assert read_text(tmp_path / "a", expected="x", most=10) == "踊"
    (tmp_path / "a").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(DanceError, match="UTF-8"):
        read_text(tmp_path / "a", expected="x", most=10)


def test_text_that_is_nested_without_end_is_refused():
    import json
    import tomllib

    for parse, text in ((json.loads, "[" * 100_000), (tomllib.loads, "a = " + "[" * 100_000)):
        with pytest.raises(DanceError, match="nested|read"):
            parsed(parse, text, "here", expected="x")
    assert parsed(json.loads, "[1]", "here", expected="x") == [1]


def archive(members, compress=zipfile.ZIP_DEFLATED):
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", compress) as z:
        for name, data in members.items():
            z.writestr(name, data)
    return stream.getvalue()


def npy(array, allow_pickle=True):
    stream = io.BytesIO()
    np.save(stream, array, allow_pickle=allow_pickle)
    return stream.getvalue()


@pytest.mark.parametrize("order", ["C", "F"])
@pytest.mark.parametrize("kind", ["<f8", ">f4", "i1", "U7", "?"])
def test_arrays_come_back_as_numpy_reads_them(rng, order, kind):
    array = np.asarray(rng.normal(size=(3, 4, 2)) * 10, dtype=kind, order=order)
    data = archive({"a.npy": npy(array), "scalar.npy": npy(np.array(7.0)), "none.npy": npy(np.zeros((0, 3)))})
    ours = read_arrays(data, "x", expected="x")
    with np.load(io.BytesIO(data)) as theirs:
        for name in theirs.files:
            np.testing.assert_array_equal(ours[name], theirs[name])
            assert ours[name].dtype == theirs[name].dtype
    ours["scalar"][...] = 1.0  # nobody else's memory


def test_objects_are_left_alone_and_what_is_no_array_too():
    assert list(
        read_arrays(
            archive({"a.npy": npy(np.array([{}])), "b.npy": b"hm", "c.npy": npy(np.ones(2))}), "x", expected="x"
        )
    ) == ["c"]


def test_a_bomb_is_refused_unopened():
    zeros = archive({f"{k}.npy": bytes(60 << 20) for k in range(10)})
    assert len(zeros) < 1 << 20
    with pytest.raises(DanceError, match="unpacks to"):
        read_arrays(zeros, "x", expected="x")


@pytest.mark.parametrize("shape", ["(1000000000000,)", "(-1,)", "(3, -5)", "(99,)", "(1e3,)", "'x'"])
def test_a_header_that_says_more_than_there_is_is_refused(shape):
    head = f"{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}".encode()
    head = head.ljust(118) + b"\n"
    data = b"\x93NUMPY\x01\x00" + len(head).to_bytes(2, "little") + head + bytes(64)
    with pytest.raises(DanceError, match="broken archive"):
        read_arrays(archive({"a.npy": data}), "x", expected="x")


def test_a_byte_that_is_flipped_inside_is_noticed(rng):
    data = bytearray(archive({"a.npy": npy(rng.normal(size=1000))}, zipfile.ZIP_STORED))
    data[len(data) // 2] ^= 1
    with pytest.raises(DanceError, match="CRC"):
        read_arrays(bytes(data), "x", expected="x")


@pytest.mark.parametrize(
    "text", ["\x1b[2J", "a\rb", "bell\x07", "\u202egnp.exe", "\u2028", "\x9b1m", "\udcff", "zero\u200bwidth"]
)
def test_nothing_that_moves_a_cursor_or_hides_is_left(text):
    out = printable(text)
    assert out.isprintable() and printable(out) == out


@pytest.mark.parametrize("text", ["plain", "踊り.csv", "é", "two\nlines", "[/x] :smile:", ""])
def test_what_is_harmless_stays(text):
    assert printable(text) == text


@pytest.mark.parametrize(
    "text", ["../../etc/x", "/abs", "a\\b", "..", ".", "", "\x1b[2J", "a\0b", "CON\n", "x" * 5000, "~"]
)
def test_no_name_leaves_its_folder(text, tmp_path):
    name = file_name(text)
    assert name and len(name) <= MAX_NAME and (tmp_path / name).resolve().parent == tmp_path.resolve()
    (tmp_path / name).touch()


def test_good_names_stay():
    for name in ("g1", "my_robot-2.1", "舞者"):
        assert file_name(name) == name


@pytest.mark.parametrize(
    "pattern",
    [
        "(a+)+b",
        "(a|a)*",
        "(.*)*",
        "(x{1,9}){1,9}",
        ".*.*.*.*.*",
        "a" * 500,
        "(",
        "[",
        "a{99999999999}",
        "a?" * 30 + "a" * 30,
        "(a|a)" * 30,
        0.5,  # no text: a number, or a list, found by the fuzzing
        [".*"],
    ],
)
def test_patterns_that_may_not_end_are_refused(pattern):
    with pytest.raises(DanceError):
        check_pattern(pattern, "x")


@pytest.mark.parametrize("pattern", [".*", ".*_hip_(pitch|yaw)_joint", "(left_)?knee.*", "[*+]x", r"a\*b", "j[0-9]+"])
def test_patterns_of_profiles_pass(pattern):
    assert check_pattern(pattern, "x") == pattern


def test_nothing_of_the_current_folder_is_code(tmp_path, monkeypatch):
    for name in ("resource.py", "numpy.py", "tracking.py"):
        (tmp_path / name).write_text("open('ran', 'w')")
    monkeypatch.chdir(tmp_path)
    refusal_of_child("import numpy", [])
    assert not (tmp_path / "ran").exists()


def test_a_child_that_ends_well_says_nothing_and_one_that_does_not_says_why():
    assert refusal_of_child("import sys; assert sys.argv[1:] == ['a b']", ["a b"]) == ""
    assert refusal_of_child("raise ValueError('of mine')", []) == "ValueError: of mine"
    assert "signal" in refusal_of_child("import os; os.kill(os.getpid(), 9)", [])
    assert "within 0.5 s" in refusal_of_child("while True: pass", [], seconds=0.5)
    assert "Memory" in refusal_of_child("x = bytearray(3 << 30)", [])


def test_the_limits_leave_room_for_what_the_field_has():
    assert table.MAX_CONFIG > 10 * 30_000 and table.MAX_MODEL > 10 * 2_000_000 and table.MAX_UNPACKED > 320 << 20
