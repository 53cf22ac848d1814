"""The best ten seconds, a little slower, mirrored, and twice in a row."""

from pathlib import Path

import clips.samples
from clips import at_speed, cut, read_clip
from retarget import retarget_sequence
from retarget.targets import mirrored
from robot_models import load_robot

clip = read_clip(Path(clips.samples.__path__[0]) / "groove.csv")
verse = at_speed(cut(clip, 1.0, 5.0), 0.9)
result, transitions = retarget_sequence([verse, mirrored(verse)], load_robot("g1"))

print(result)
for transition in transitions:
    print("  ", transition)
result.save("verse_twice.npz")
