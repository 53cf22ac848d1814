"""From markers on the skin to joints: the marker sets of the field and the anatomy between marker and joint.

Hip joints by Bell, Pedersen & Brand (1990): 14 % of the distance between the front hip bones inwards, 30 % down and 19 %
back from each. Where a knee or an ankle carries one marker on its outside, half the width of an adult's joint lies between.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float
from numpy import ndarray

from clips.provenance import Finding
from robot_models.maths import rotation as rot

# Names by marker set, {S} for L or R: Plug-in Gait; CMU; Rizzoli as in OptiTrack's Biomech; Qualisys and Motive.
_FRONT = ("{S}ASI", "{S}FWT", "{S}IAS", "Waist{S}Front")
_BACK = ("{S}PSI", "{S}BWT", "{S}IPS", "Waist{S}Back")
_SACRUM = ("SACR", "VSAC", "SACRUM", "WaistBack")
_SETS = ("Plug-in Gait", "CMU", "Rizzoli (OptiTrack Biomech)", "Qualisys / Motive")
_OUTER = {
    "knee": ("{S}KNE", "{S}FLE", "{S}KneeOut"),
    "ankle": ("{S}ANK", "{S}FAL", "{S}AnkleOut"),
    "elbow": ("{S}ELB", "{S}HLE", "{S}ElbowOut"),
    "wrist": ("{S}WRA", "{S}OWR", "{S}RSP", "{S}WristOut", "{S}WRI"),
    "shoulder": ("{S}SHO", "{S}CAJ", "{S}ShoulderTop", "{S}ACR"),
    "toe": ("{S}TOE", "{S}FM2", "{S}Forefoot2", "{S}ToeTip", "{S}MT2", "{S}ToeIn"),
}
_INNER = {
    "knee": ("{S}KNM", "{S}KNEM", "{S}FME", "{S}KneeIn"),
    "ankle": ("{S}ANM", "{S}MED", "{S}TAM", "{S}AnkleIn"),
    "elbow": ("{S}ELM", "{S}ELBM", "{S}HME", "{S}ElbowIn"),
    "wrist": ("{S}WRB", "{S}IWR", "{S}USP", "{S}WristIn"),
}
_HEAD = (("LFHD", "RFHD", "LBHD", "RBHD"), ("LFHD", "RFHD"), ("HeadL", "HeadR"), ("HeadTop",), ("ARIEL",), ("SGL",))
# Half an adult's width and half a marker (14 mm), and how far the shoulder joint lies under the acromion's marker [m].
_HALF_WIDTH = {"knee": 0.057, "ankle": 0.042}
_SHOULDER_DROP = 0.05


def joint_centres(
    markers: Mapping[str, Float[ndarray, "T 3"]],
) -> tuple[dict[str, Float[ndarray, "T 3"]], Finding] | None:
    """Landmarks from markers; None where the names are of no marker set known here.

    Args:
        markers: name -> positions [m], NaN where lost.
    """
    fronts = [next((n for n in _FRONT if n.format(S=s) in markers), None) for s in "LR"]
    if fronts[0] is None or fronts[0] != fronts[1]:
        return None
    front = [markers[fronts[0].format(S=s)] for s in "LR"]
    back = [_one(markers, _BACK, s) for s in "LR"]
    sacrum = _one(markers, _SACRUM, "")
    middle_back = sacrum if back[0] is None or back[1] is None else 0.5 * (back[0] + back[1])
    if middle_back is None:
        return None
    wide = front[0] - front[1]
    width = np.linalg.norm(wide, axis=-1, keepdims=True)
    left = rot.unit(wide)
    ahead = 0.5 * (front[0] + front[1]) - middle_back
    ahead = rot.unit(ahead - np.sum(ahead * left, axis=-1, keepdims=True) * left)
    up = np.cross(ahead, left)
    points = {"pelvis": 0.25 * (front[0] + front[1]) + 0.5 * middle_back}
    for side, letter, marker, sign in (("left", "L", front[0], -1.0), ("right", "R", front[1], 1.0)):
        across = sign * left  # towards the other leg
        points[f"{side}_hip"] = marker + width * (0.14 * across - 0.30 * up - 0.19 * ahead)
        for part, above in (("knee", "hip"), ("ankle", "knee")):
            centre = _joint(markers, part, letter)
            if centre is None and (outer := _one(markers, _OUTER[part], letter)) is not None:
                along = rot.unit(outer - points[f"{side}_{above}"])
                inwards = rot.unit(across - np.sum(across * along, axis=-1, keepdims=True) * along)
                centre = outer + _HALF_WIDTH[part] * inwards
            if centre is None:
                return None
            points[f"{side}_{part}"] = centre
        for part in ("elbow", "wrist", "shoulder", "toe"):
            centre = _joint(markers, part, letter) if part in _INNER else None
            centre = _one(markers, _OUTER[part], letter) if centre is None else centre
            if centre is not None:
                points[f"{side}_{part}"] = centre
    if "left_shoulder" in points and "right_shoulder" in points:
        down = rot.unit(points["pelvis"] - 0.5 * (points["left_shoulder"] + points["right_shoulder"]))
        for side in ("left", "right"):
            points[f"{side}_shoulder"] = points[f"{side}_shoulder"] + _SHOULDER_DROP * down
        points["neck"] = 0.5 * (points["left_shoulder"] + points["right_shoulder"])
    head = next((h for h in _HEAD if all(n in markers for n in h)), None)
    if head:
        points["head"] = np.mean([markers[n] for n in head], axis=0)
    name = _SETS[_FRONT.index(fronts[0])]
    why = f"{fronts[0].format(S='L')} and {fronts[0].format(S='R')} among its {len(markers)} labels; hips by Bell's regression"
    return points, Finding(what="marker set", value=name, why=why, confidence="measured", option="mapping")


def _one(markers: Mapping[str, ndarray], names: tuple[str, ...], letter: str) -> Float[ndarray, "T 3"] | None:
    """The first of the markers that is there and was seen at all."""
    found = (markers.get(n.format(S=letter)) for n in names)
    return next((m for m in found if m is not None and np.isfinite(m).any()), None)


def _joint(markers: Mapping[str, ndarray], part: str, letter: str) -> Float[ndarray, "T 3"] | None:
    """The middle between the outer and the inner marker, where both are there."""
    outer, inner = _one(markers, _OUTER[part], letter), _one(markers, _INNER[part], letter)
    return None if outer is None or inner is None else 0.5 * (outer + inner)
