"""Every number of the retargeting can be set; gates of your own decide what passes."""

from dataclasses import replace
from pathlib import Path

import clips.samples
from clips import MetricKey, cut, read_clip
from retarget import Gates, ObjectiveWeights, RetargetConfig, retarget
from robot_models import load_robot

clip = cut(read_clip(Path(clips.samples.__path__[0]) / "groove.bvh"), 0.0, 4.0)
strict = RetargetConfig(gates=Gates(slide_mm=5.0), lead_in_s=0.5, lead_out_s=0.5)
soft_arms = replace(strict, weights=ObjectiveWeights(arm=5.0))

for name, config in (("default", RetargetConfig()), ("strict", strict), ("soft arms", soft_arms)):
    report = retarget(clip, load_robot("dancer"), config).report
    limbs = report[MetricKey.LIMB_DIRECTION_ERROR]
    print(f"{name:10} {report!r}, limbs {limbs.value:.2f} {limbs.unit}")
