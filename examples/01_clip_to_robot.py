"""A recorded dance on a robot: read, retarget, look at the verdict, keep it. About two seconds."""

from pathlib import Path

import clips.samples
from clips import read_clip
from retarget import retarget
from robot_models import load_robot

clip = read_clip(Path(clips.samples.__path__[0]) / "groove.bvh")
print(clip)
for finding in clip.source.findings:
    print("  ", finding)

result = retarget(clip, load_robot("dancer"))
print(result)
for diagnosis in result.diagnoses:
    print("missed:", diagnosis)

result.save("groove.npz")  # the reference
result.save("groove.rrd")  # the recording; result.show() opens it at once
