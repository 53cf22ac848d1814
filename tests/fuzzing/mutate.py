"""Damage to a file: bytes, numbers, chunks, and arrays of an archive; a seed of its own makes each case again."""

from __future__ import annotations

import io
import random
import re

import numpy as np

NUMBER = re.compile(rb"-?\d+\.?\d*(?:[eE][-+]?\d+)?")
EXTREMES = (
    b"0", b"-0", b"-1", b"1e308", b"-1e308", b"1e-320", b"nan", b"inf", b"-inf", b"99999999999999999999", b"2147483648", b"1e9",
    b"0.5", b"", b"null", b"true", b'"x"', b"[]", b"{}", b"NaN", b"Infinity", b"0x10", b"1_0", b"\xef\xbc\x91",
)  # fmt: skip
TOKENS = (
    b"\x00", b"\x1b[2J", b"\xff\xfe", b"[[[[[[[[", b"{" * 50, b'"' , b"'", b"\n\n", b",", b";", b"\t", b"=", b":", b"../", b"(.*)*",
    b"<include file='/dev/zero'/>", b"&a", b"*a", b"#", b"/*", b"<!--", b"\\u0000", b"e" * 300, "踊".encode(), b"\r", b"-" * 40,
)  # fmt: skip


def mutated(seed: bytes, rng: random.Random) -> bytes:
    """The seed with one to four damages."""
    out = bytearray(seed)
    for _ in range(rng.choice((1, 1, 1, 2, 4))):
        out = bytearray(rng.choice(_WAYS)(bytes(out), rng))
    return bytes(out)


def _flip(data: bytes, rng: random.Random) -> bytes:
    out = bytearray(data)
    for _ in range(rng.choice((1, 1, 4, 32))):
        if out:
            out[rng.randrange(len(out))] ^= 1 << rng.randrange(8)
    return bytes(out)


def _cut(data: bytes, rng: random.Random) -> bytes:
    a, b = sorted(rng.randrange(len(data) + 1) for _ in range(2))
    return data[:a] if rng.random() < 0.3 else data[:a] + data[b:]


def _repeat(data: bytes, rng: random.Random) -> bytes:
    a, b = sorted(rng.randrange(len(data) + 1) for _ in range(2))
    b = min(b, a + 4000)
    return data[:b] + data[a:b] * rng.choice((1, 2, 30)) + data[b:]


def _insert(data: bytes, rng: random.Random) -> bytes:
    a = rng.randrange(len(data) + 1)
    return data[:a] + rng.choice(TOKENS) + data[a:]


def _number(data: bytes, rng: random.Random) -> bytes:
    found = [m.span() for m in NUMBER.finditer(data[:200_000])]
    if not found:
        return _flip(data, rng)
    a, b = rng.choice(found)
    return data[:a] + rng.choice(EXTREMES) + data[b:]


def _line(data: bytes, rng: random.Random) -> bytes:
    lines = data.split(b"\n")
    k, j = rng.randrange(len(lines)), rng.randrange(len(lines))
    if rng.random() < 0.5:
        lines[k], lines[j] = lines[j], lines[k]
    else:
        del lines[k]
    return b"\n".join(lines)


def _arrays(data: bytes, rng: random.Random) -> bytes:
    """Another archive, with one of its arrays altered, absent, of another shape or kind."""
    try:
        with np.load(io.BytesIO(data), allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
    except Exception:  # damaged before: zip's and numpy's parsers raise whatever they like
        return _flip(data, rng)
    if not arrays:
        return data
    name = rng.choice(sorted(arrays))
    changed = rng.choice(_CHANGES)(arrays[name], rng)
    if changed is None:
        del arrays[name]
    else:
        arrays[name] = changed
    out = io.BytesIO()
    np.savez(out, **arrays)
    return out.getvalue()


def _value(array: np.ndarray, rng: random.Random) -> np.ndarray:
    out = np.array(array)
    if out.dtype.kind == "U":
        return np.array(["\x1b[2J" if rng.random() < 0.5 else str(x) * 2 for x in out.ravel()]).reshape(out.shape)
    if out.size and out.dtype.kind in "fiub":
        with np.errstate(all="ignore"):
            value = rng.choice((np.nan, np.inf, -np.inf, 1e300, -1.0, 0.0, 99.0, 1e9))
            out = out.astype(float) if rng.random() < 0.7 else out
            out.ravel()[rng.randrange(out.size)] = value if out.dtype.kind == "f" else 99
    return out


_CHANGES = (
    _value, _value, _value,
    lambda a, r: None,
    lambda a, r: a[: r.randrange(len(a) + 1)] if a.ndim else a.reshape(1),
    lambda a, r: a.reshape(-1),
    lambda a, r: a[..., None],
    lambda a, r: a.astype(complex) if a.dtype.kind in "fiu" else np.zeros(3),
    lambda a, r: a.astype(r.choice((np.float16, np.float32, np.int8, np.uint64))) if a.dtype.kind in "fiu" else a.astype("S9"),
    lambda a, r: a * r.choice((-1.0, 7.0, 1e-3, -50.0)) if a.dtype.kind in "fiu" else a,
    lambda a, r: np.array("x" * r.choice((0, 5, 5000))),
    lambda a, r: np.array(r.choice(('{"format_version": 1', "[" * 5000, "3", "null", '{"format_version": 1, "robot": 3}'))),
    lambda a, r: np.zeros((0, *a.shape[1:])) if a.ndim else a,
)  # fmt: skip
_WAYS = (_flip, _cut, _repeat, _insert, _number, _number, _number, _line, _arrays, _arrays)
