"""Opens one C3D in a process of its own: `python c3d_worker.py FILE BYTES`, plain arrays as .npz on standard output.

ezc3d believes a file's own word on how many points, frames and parameters it holds; a broken one can take all memory or
the whole process. Here only this process goes, at a limit of BYTES.
"""

import io
import re
import sys

# POINT groups that list computed quantities, which are no places.
_COMPUTED = ("ANGLES", "FORCES", "MOMENTS", "POWERS", "SCALARS", "REACTIONS")


def main(file: str, most: int) -> None:
    """Read the file; an error goes to standard error in one line."""
    try:
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (most, most))
    except ImportError:  # Windows has no such limit; the caller's time limit stands
        pass
    import ezc3d
    import numpy as np

    try:
        content = ezc3d.c3d(file)
    except Exception as e:  # its C++ raises OSError, ValueError, RuntimeError, whatever stands in the bytes
        sys.exit(f"{e}" or type(e).__name__)
    point = {k: v["value"] for k, v in content["parameters"].get("POINT", {}).items() if "value" in v}
    # More than 255 labels are spread over LABELS, LABELS2 ...
    groups = sorted((k for k in point if re.fullmatch(r"LABELS\d*", k)), key=lambda k: int(k[6:] or 1))
    out = io.BytesIO()
    np.savez(
        out,
        points=content["data"]["points"][:3],
        residuals=content["data"]["meta_points"]["residuals"][0],
        rate=float(content["header"]["points"]["frame_rate"]),
        labels=np.array([str(label) for k in groups for label in point[k]], dtype=str),
        computed=np.array([str(x) for k in _COMPUTED for x in point.get(k, ())], dtype=str),
        units=np.array([str(x) for x in point.get("UNITS", ())], dtype=str),
        frames=np.ravel(point.get("FRAMES", ())).astype(float),
    )
    sys.stdout.buffer.write(out.getvalue())


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]))
