"""How far a point on the floor is from what a robot stands on."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float
from numpy import ndarray


def outside_support(
    point: Float[ndarray, "T 2"], feet: Float[ndarray, "T P 2"], in_contact: Bool[ndarray, "T P"]
) -> Float[ndarray, "T"]:
    """Distance of a point on the floor from the convex hull of the touching sole points [m]; 0 inside.

    The hull's rim is made of segments between its points, and every such segment lies in it, so the least distance
    to all of them is the distance to the hull. A point is inside unless all others lie on one side of a line through
    it. Frames without a touching point or with NaN give 0.
    """
    first = np.take_along_axis(feet, in_contact.argmax(axis=1)[:, None, None], axis=1)
    corners = np.where(in_contact[..., None], feet, first)
    a, b = np.triu_indices(feet.shape[1], 1)
    start, along, to = corners[:, a], corners[:, b] - corners[:, a], point[:, None] - corners[:, a]
    share = np.clip(np.sum(to * along, axis=-1) / np.maximum(np.sum(along**2, axis=-1), 1e-18), 0.0, 1.0)
    distance = np.linalg.norm(start + share[..., None] * along - point[:, None], axis=-1).min(axis=1)
    seen = np.sort(np.arctan2(*np.moveaxis(corners - point[:, None], -1, 0)[::-1]), axis=1)
    gaps = np.diff(seen, axis=1, append=seen[:, :1] + 2.0 * np.pi)
    outside = (gaps.max(axis=1) > np.pi) & in_contact.any(axis=1) & np.isfinite(point).all(axis=1)
    return np.where(outside, distance, 0.0)
