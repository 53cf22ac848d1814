"""What no reader takes is refused by name."""

import pytest

from clips import ClipError, read_clip


@pytest.mark.parametrize(
    "name, content, match",
    [
        ("a.fbx", b"Kaydara FBX Binary  \x00\x1a\x00", "Blender"),
        ("a.txt", b"hello", "content that no reader knows"),
        ("a.bvh", b"", "0 bytes"),
        ("a.npz", b"PK\x03\x04broken.npy", "broken archive"),
        ("a.pkl", b"\x80\x04broken", "broken pickle"),
        ("a.csv", b"1,2,3\n", "1 rows"),
    ],
)
def test_what_cannot_be_read_is_refused_by_name(tmp_path, name, content, match):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(ClipError, match=match):
        read_clip(tmp_path / name)


def test_a_missing_file_is_refused(tmp_path):
    with pytest.raises(ClipError, match="no such file"):
        read_clip(tmp_path / "nothing.bvh")
