"""VMD: MikuMikuDance's motions, keys of named bones at 30 frames per second. The body they were made for is not in them.

A figure of 20 units, as most models are, stands in for it: its arms hang 38 degrees below the horizontal at rest and its
legs reach for the places of the IK bones. Left-handed, y up, facing -z: with z turned round it is the field's y-up world.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips.clip import MIN_FRAMES, HumanClip
from clips.edit import sample_quat
from clips.errors import ClipError
from clips.identify import human_clip
from clips.provenance import Finding, RawFile, ReadOptions
from robot_models.maths import rotation as rot

_MAGIC = b"Vocaloid Motion Data"
_HEAD, _NAME, _NAME_OLD = 30, 20, 10
_KEY = np.dtype([("name", "S15"), ("frame", "<u4"), ("pos", "<f4", 3), ("quat", "<f4", 4), ("curve", "u1", 64)])
_FPS = 30.0
_MOST_FRAMES = 200_000
_LEAST_BONES = 4
_UNIT = 0.08  # metres, by custom
_Bone = tuple[str, str, tuple[float, float, float]]
# Bone, its parent, its place at rest in units (x to the figure's left, y up, z ahead): an adult's proportions on 20 units.
_LEFT_ARM = (
    ("左肩", "上半身2", (0.3, 16.2, 0.0)), ("左腕", "左肩", (1.35, 16.0, 0.0)), ("左ひじ", "左腕", (3.45, 14.35, 0.0)),
    ("左手首", "左ひじ", (5.3, 12.9, 0.0)),
)  # fmt: skip
_LEFT_LEG = (
    ("左足", "下半身", (0.9, 11.3, 0.0)), ("左ひざ", "左足", (0.9, 6.4, 0.1)), ("左足首", "左ひざ", (0.9, 1.2, 0.0)),
    ("左つま先", "左足首", (0.9, 0.1, 1.6)),
)  # fmt: skip
_MIDDLE = (
    ("全ての親", "", (0.0, 0.0, 0.0)), ("センター", "全ての親", (0.0, 8.0, 0.0)), ("グルーブ", "センター", (0.0, 8.2, 0.0)),
    ("腰", "グルーブ", (0.0, 11.9, 0.0)), ("下半身", "腰", (0.0, 12.2, 0.0)), ("上半身", "腰", (0.0, 12.3, 0.0)),
    ("上半身2", "上半身", (0.0, 14.0, 0.0)), ("首", "上半身2", (0.0, 16.7, 0.0)), ("頭", "首", (0.0, 17.5, 0.0)),
)  # fmt: skip


def _right(
    bones: tuple[tuple[str, str, tuple[float, float, float]], ...],
) -> tuple[tuple[str, str, tuple[float, float, float]], ...]:
    return tuple((n.replace("左", "右"), p.replace("左", "右"), (-x, y, z)) for n, p, (x, y, z) in bones)


_BONES = (*_MIDDLE, *_LEFT_ARM, *_right(_LEFT_ARM), *_LEFT_LEG, *_right(_LEFT_LEG))
_REST = {name: np.array(place) for name, _, place in _BONES}
_LANDMARKS = {
    "pelvis": "下半身", "chest": "上半身2", "neck": "首", "head": "頭",
} | {
    f"{side}_{part}": f"{sign}{bone}"
    for side, sign in (("left", "左"), ("right", "右"))
    for part, bone in (
        ("shoulder", "腕"), ("elbow", "ひじ"), ("wrist", "手首"), ("hip", "足"), ("knee", "ひざ"), ("ankle", "足首"),
        ("toe", "つま先"),
    )
}  # fmt: skip
_TWISTS = {
    "左ひじ": "左腕捩",
    "右ひじ": "右腕捩",
    "左手首": "左手捩",
    "右手首": "右手捩",
}  # turned before the bone itself


@dataclass(frozen=True, kw_only=True)
class _Track:
    """A bone's way, relative to rest."""

    move: Float[ndarray, "T 3"]
    turn: Float[ndarray, "T 4"]
    keys: int


def recognises(raw: RawFile) -> bool:
    """The first words of either version."""
    return raw.head.startswith(_MAGIC)


def read(raw: RawFile, options: ReadOptions) -> HumanClip:
    """Pose the figure by the keys.

    Raises:
        ClipError: a file cut off, keys of no body (a camera's), numbers that are none.
    """
    keys = _keys(raw)
    frames = int(max(k["frame"].max() for k in keys.values())) + 1
    if not MIN_FRAMES <= frames <= _MOST_FRAMES:
        raise ClipError(raw.name, found=f"{frames} frames", expected=f"{MIN_FRAMES} to {_MOST_FRAMES}")
    tracks = {name: _track(key, frames) for name, key in keys.items()}
    rest = _Track(move=np.zeros((frames, 3)), turn=np.tile(rot.IDENTITY, (frames, 1)), keys=0)
    places, turns = _posed(tracks, rest)
    by_ik = [side for side in "左右" if _reaches(tracks, side)]
    for side in by_ik:
        _reach(places, turns, tracks, side)
    fps = options.fps or _FPS
    names = [name for name, _, _ in _BONES]
    found = [
        Finding(what="fps", value=f"{fps:g}", why="given" if options.fps else "VMD's, by its definition",
                confidence="stated", option="fps"),
        Finding(what="skeleton", value="a figure of 20 units", why="VMD holds the keys of bones, not their lengths",
                confidence="assumed", option="stature"),
        Finding(what="legs", value="by their IK bones" if by_ik else "by their own turns",
                why=f"keys of {len(by_ik)} legs' IK bones", confidence="measured"),
    ]  # fmt: skip
    return human_clip(
        raw, dialect=f"VMD, {len(keys)} bones with keys", fps=fps, names=names,
        positions=_UNIT * np.stack([places[n] for n in names], axis=1),
        orientations=rot.normalise(np.stack([turns[n] for n in names], axis=1)),
        parents=[names.index(p) if p else -1 for _, p, _ in _BONES], options=options, findings=found, landmarks=_LANDMARKS,
    )  # fmt: skip


def _keys(raw: RawFile) -> dict[str, ndarray]:
    """Keys by bone in the order of their frames, in our axes; of two at one frame the later."""
    name = _NAME if b"0002" in raw.data[:_HEAD] else _NAME_OLD
    at = _HEAD + name
    if len(raw.data) < at + 4:
        raise ClipError(raw.name, found=f"{len(raw.data)} bytes", expected="a VMD's header")
    (count,) = struct.unpack_from("<I", raw.data, at)
    if at + 4 + count * _KEY.itemsize > len(raw.data):
        raise ClipError(
            raw.name,
            found=f"{len(raw.data)} bytes",
            expected=f"{count} keys",
            cure="the file is cut off: copy it again",
        )
    table = np.frombuffer(raw.data, _KEY, count=count, offset=at + 4)
    if not (
        np.isfinite(table["pos"]).all() and np.isfinite(table["quat"]).all() and (np.abs(table["pos"]) < 1e5).all()
    ):
        raise ClipError(raw.name, found="keys that are not finite, or absurd", expected="places and quaternions")
    wanted = {*_REST, *_TWISTS.values(), *(f"{side}{end}" for side in "左右" for end in ("足ＩＫ", "足IK親"))}
    rows: dict[str, list[int]] = {}
    for k, name in enumerate(table["name"]):
        bone = bytes(name).split(b"\0")[0].decode("shift_jis", errors="replace")
        if bone in wanted:  # of thousands of others, of skirts and hair, nothing is made
            rows.setdefault(bone, []).append(k)
    found = {}
    for bone, places in rows.items():
        own = table[places]
        _, last = np.unique(own["frame"][::-1], return_index=True)
        found[bone] = own[::-1][last]
    body = set(found) & {*_REST, *(f"{side}足ＩＫ" for side in "左右")}
    if len(body) < _LEAST_BONES:
        raise ClipError(
            raw.name, found=f"keys of {len(body)} bones of a body among {len(table)} keys", expected="a dance",
            cure="a camera's or a face's VMD has none: take the one of the motion",
        )  # fmt: skip
    return found


def _track(keys: ndarray, frames: int) -> _Track:
    """Keys brought to every frame along their curves (four Bezier curves a key: x, y, z, turn; over 127)."""
    times = np.arange(frames)
    after = np.clip(np.searchsorted(keys["frame"], times, side="left"), 0, len(keys) - 1)
    before = np.clip(after - (keys["frame"][after] > times), 0, None)
    span = np.maximum(keys["frame"][after].astype(float) - keys["frame"][before], 1.0)
    share = np.clip((times - keys["frame"][before].astype(float)) / span, 0.0, 1.0)
    curves = keys["curve"][after].astype(float).reshape(frames, 4, 16)[:, :, ::4] / 127.0  # x1, y1, x2, y2
    moved = [_eased(share, curves[:, k]) for k in range(4)]
    pos = keys["pos"].astype(float) * (1.0, 1.0, -1.0)
    quat = keys["quat"].astype(float)[:, [3, 0, 1, 2]] * (1.0, -1.0, -1.0, 1.0)
    quat[np.linalg.norm(quat, axis=1) < 1e-6] = rot.IDENTITY
    turns = rot.continuous(rot.normalise(quat))
    move = np.stack([pos[before, k] + moved[k] * (pos[after, k] - pos[before, k]) for k in range(3)], axis=1)
    turn = (
        sample_quat(turns, before + moved[3] * (after - before)) if len(turns) > 1 else np.repeat(turns, frames, axis=0)
    )
    return _Track(move=move, turn=np.asarray(turn), keys=len(keys))


def _eased(share: Float[ndarray, "T"], curve: Float[ndarray, "T 4"]) -> Float[ndarray, "T"]:
    """y of a cubic Bezier from (0, 0) to (1, 1) where its x is `share`, by halving."""
    low, high = np.zeros_like(share), np.ones_like(share)
    for _ in range(20):
        t = 0.5 * (low + high)
        left = 3.0 * (1.0 - t) ** 2 * t * curve[:, 0] + 3.0 * (1.0 - t) * t**2 * curve[:, 2] + t**3 < share
        low, high = np.where(left, t, low), np.where(left, high, t)
    t = 0.5 * (low + high)
    eased = 3.0 * (1.0 - t) ** 2 * t * curve[:, 1] + 3.0 * (1.0 - t) * t**2 * curve[:, 3] + t**3
    return np.where(share <= 0.0, 0.0, np.where(share >= 1.0, 1.0, eased))


def _posed(tracks: dict[str, _Track], rest: _Track) -> tuple[dict[str, ndarray], dict[str, ndarray]]:
    """Places and turns of all bones by their own keys."""
    places, turns = dict[str, ndarray](), dict[str, ndarray]()
    for name, parent, _ in _BONES:
        own, twist = tracks.get(name, rest), tracks.get(_TWISTS.get(name, ""), rest)
        local = _REST[name] - (_REST[parent] if parent else 0.0) + own.move
        before = rot.multiply(turns[parent], twist.turn) if parent else own.turn
        places[name] = places[parent] + rot.rotate(turns[parent], local) if parent else local
        turns[name] = rot.multiply(before, own.turn) if parent else own.turn
    return places, turns


def _reaches(tracks: dict[str, _Track], side: str) -> bool:
    """Whether a leg is led by its IK bone: it has keys, and the knee has none that bend it."""
    foot, knee = tracks.get(f"{side}足ＩＫ"), tracks.get(f"{side}ひざ")
    return foot is not None and (foot.keys > 1 or knee is None or knee.keys < 2)


def _reach(places: dict[str, ndarray], turns: dict[str, ndarray], tracks: dict[str, _Track], side: str) -> None:
    """Hip, knee and ankle in one plane, the ankle at the IK bone's place where the leg is long enough; the foot turned as it."""
    ik, hip, knee, ankle, toe = (f"{side}{bone}" for bone in ("足ＩＫ", "足", "ひざ", "足首", "つま先"))
    root = places["全ての親"], turns["全ての親"]
    over = tracks.get(f"{side}足IK親")
    local = _REST[ankle] + tracks[ik].move + (over.move if over is not None else 0.0)
    goal = root[0] + rot.rotate(root[1], local)
    thigh, shank = (float(np.linalg.norm(_REST[b] - _REST[a])) for a, b in ((hip, knee), (knee, ankle)))
    way = goal - places[hip]
    far = np.linalg.norm(way, axis=1, keepdims=True)
    reach = np.clip(far, abs(thigh - shank) + 1e-3, 0.999 * (thigh + shank))
    along = way / np.maximum(far, 1e-9)
    ahead = rot.rotate(turns[hip], np.array([0.0, 0.0, 1.0]))
    bend = rot.unit(ahead - np.sum(ahead * along, axis=1, keepdims=True) * along)
    near = (thigh**2 - shank**2 + reach**2) / (2.0 * reach)
    places[knee] = places[hip] + near * along + np.sqrt(np.maximum(thigh**2 - near**2, 0.0)) * bend
    places[ankle] = places[hip] + reach * along
    turns[ankle] = rot.multiply(root[1], tracks[ik].turn)
    places[toe] = places[ankle] + rot.rotate(turns[ankle], _REST[toe] - _REST[ankle])
    turns[toe] = turns[ankle]
