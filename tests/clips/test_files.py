"""Outputs: in place whole when the block ends, and when it does not end well, nothing of them."""

import errno
import os
import stat
import sys

import pytest

from clips import OutputError
from clips.files import aside, write_whole


def test_nothing_stands_in_the_place_before_the_block_ends(tmp_path):
    path = tmp_path / "out.npz"
    with write_whole(path) as stream:
        stream.write(b"half")
        stream.flush()
        assert not path.exists() and len(list(tmp_path.iterdir())) == 1
        stream.write(b" and half")
    assert path.read_bytes() == b"half and half" and list(tmp_path.iterdir()) == [path]


def test_the_old_file_is_whole_until_the_new_one_is(tmp_path):
    path = tmp_path / "out.npz"
    path.write_bytes(b"old")
    with aside(path) as beside:
        beside.write_bytes(b"new")
        assert path.read_bytes() == b"old"
        assert (beside.parent, beside.suffix) == (path.parent, ".npz")  # writers look at endings
    assert path.read_bytes() == b"new"


def test_of_two_writers_at_once_the_last_to_end_wins_whole(tmp_path):
    path = tmp_path / "out.bin"
    with write_whole(path) as slow:
        slow.write(b"slow")
        with write_whole(path) as fast:
            fast.write(b"fast and longer")
        assert path.read_bytes() == b"fast and longer"
    assert path.read_bytes() == b"slow" and list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(
    "error", [KeyboardInterrupt(), SystemExit(1), ValueError("mine"), FileNotFoundError(errno.ENOENT, "another file")]
)
def test_whatever_ends_the_block_early_passes_through_and_leaves_nothing(tmp_path, error):
    with pytest.raises(type(error)) as passed, write_whole(tmp_path / "out.bin") as stream:
        stream.write(b"half")
        raise error
    assert passed.value is error and not list(tmp_path.iterdir())


@pytest.mark.parametrize("code", [errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EFBIG])
def test_a_disk_that_takes_no_more_is_told_by_the_outputs_name_and_leaves_the_old_file(tmp_path, code):
    path = tmp_path / "out.bin"
    path.write_bytes(b"old")
    with pytest.raises(OutputError, match=r"out\.bin: found a write that failed"), write_whole(path) as stream:
        stream.write(b"half")
        raise OSError(code, os.strerror(code))
    assert path.read_bytes() == b"old" and list(tmp_path.iterdir()) == [path]


def test_a_folder_in_the_place_is_refused_and_stays(tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "inside").touch()
    with pytest.raises(OutputError, match="a write that failed"), write_whole(tmp_path / "out") as stream:
        stream.write(b"x")
    assert [p.name for p in tmp_path.iterdir()] == ["out"] and (tmp_path / "out" / "inside").exists()


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such modes")
@pytest.mark.parametrize("mask", [0o022, 0o077, 0o002])
def test_a_new_file_is_as_open_to_others_as_any_file_the_user_makes(tmp_path, mask):
    before = os.umask(mask)
    try:
        with write_whole(tmp_path / "ours") as stream:
            stream.write(b"x")
        (tmp_path / "theirs").touch()
        assert os.umask(mask) == mask  # looked at and put back
    finally:
        os.umask(before)
    assert stat.S_IMODE((tmp_path / "ours").stat().st_mode) == stat.S_IMODE((tmp_path / "theirs").stat().st_mode)


def test_a_bare_name_is_written_where_one_stands(tmp_path, monkeypatch):
    from pathlib import Path

    monkeypatch.chdir(tmp_path)
    with write_whole(Path("out.bin")) as stream:
        stream.write(b"x")
    assert (tmp_path / "out.bin").read_bytes() == b"x"
