"""A motion that another tool made: judged as it stands, then solved anew, and the two compared."""

from pathlib import Path

from clips import RobotClip, cut, read_clip, write_motion
from retarget import as_it_stands, limb_angles, retarget
from robot_models import load_robot

robot = load_robot("dancer")
dance = read_clip(Path(__file__).parents[1] / "tracking" / "policies" / "groove-dancer" / "reference.npz")
part = cut(dance, 2.0, 6.0)
assert isinstance(part, RobotClip)
write_motion(Path("motion.pkl"), "gmr", part, robot)  # as if GMR had written it

clip = read_clip("motion.pkl")
theirs, ours = as_it_stands(clip, robot), retarget(clip, robot)
print(theirs)
print(ours)
for limb, angle in limb_angles(theirs.reference, robot, ours.reference, robot).items():
    print(f"{limb:30} {angle.mean():.1f} deg apart")
