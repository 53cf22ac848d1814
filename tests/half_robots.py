"""Two robots whose model files are not at hand, from the numbers their makers published: the left half, mirrored.

High Torque's Hi (25 joints; its root is the trunk, its legs hang on a waist below) and Leju's Kuavo S45 (28 joints; legs and
arms hang on the root, names say nothing of limbs). Places, axes, ranges, torques and masses of every link, inertias of
balls as large as the links are heavy; a model file's meshes are not there, the boxes of Kuavo's feet are.
"""

AXES = {"x": "1 0 0", "y": "0 1 0", "z": "0 0 1"}

HI = """
waist_link          base_link           0.009 0 -0.2126          z -3.14 3.14  21  1.35043
l_hip_pitch_link    waist_link          0 0.0575 -0.04           y -3.14 3.14  21  0.66609
l_hip_roll_link     l_hip_pitch_link    0.02725 0.042 0          x -3.14 3.14  21  0.7909
l_thigh_link        l_hip_roll_link     -0.02725 0 -0.123        z -3.14 3.14  21  0.25619
l_calf_link         l_thigh_link        0 0.03175 -0.069         y -3.14 3.14  21  1.6402
l_ankle_pitch_link  l_calf_link         0 -0.03175 -0.19945      y -3.14 3.14  21  0.013231
l_ankle_roll_link   l_ankle_pitch_link  0.0215 0 0               x -3.14 3.14  21  0.40357
l_shoulder_pitch_link  base_link        0.009 0.11945 0.020657   y -3.14 3.14  21  0.39963
l_shoulder_roll_link   l_shoulder_pitch_link  0.02335 0.034 0    x -3.14 3.14  21  0.45112
l_upper_arm_link    l_shoulder_roll_link  -0.0236 0 -0.0977      z -3.14 3.14  21  0.39963
l_elbow_link        l_upper_arm_link    0 0.02335 -0.034         y -3.14 3.14  21  0.27632
l_wrist_link        l_elbow_link        0 -0.0236 -0.0884        z -3.14 3.14  21  0.2921
head_yaw_link       base_link           0.009 0 0.1175           z -3.14 3.14  21  0.17851
head_pitch_link     head_yaw_link       0 0.0151 0.0255          y -3.14 3.14  21  0.25396
"""

KUAVO = """
leg_l1_link   base_link     -0.0024999 0.087 -0.066     x -0.314159 0.663225  180  1.71093
leg_l2_link   leg_l1_link   0 0 0                       z -0.872665 0.785398  100  0.580292
leg_l3_link   leg_l2_link   0.000500355 -0.001 -0.1287  y -2.00713 1.5708     100  4.50393
leg_l4_link   leg_l3_link   -6.87185e-05 0 -0.284       y 0 2.53073           180  1.62777
leg_l5_link   leg_l4_link   -0.000431636 0 -0.346       y -0.872665 0.349066  36   0.0719352
leg_l6_link   leg_l5_link   0 0 0                       x -0.261799 0.261799  36   0.501754
zarm_l1_link  base_link     -0.0174999 0.2927 0.4245    y -3.14159 1.5708     100  0.962
zarm_l2_link  zarm_l1_link  0 0 0                       x -0.349066 2.0944    50   0.57
zarm_l3_link  zarm_l2_link  0 0 0                       z -1.5708 1.5708      39   1.65
zarm_l4_link  zarm_l3_link  0.02 0 -0.2837              y -2.61799 0          50   0.429
zarm_l5_link  zarm_l4_link  -0.02 0 -0.127037           z -1.5708 1.5708      12   0.61
zarm_l6_link  zarm_l5_link  0.0002 0 -0.106463          x -1.309 0.698132     12   0.331
zarm_l7_link  zarm_l6_link  0 0 -0.0210005              y -0.698132 0.698132  12   0.640524
zhead_1_link  base_link     -0.0174999 0 0.5            z -1.5708 1.5708      1.5  0.5
zhead_2_link  zhead_1_link  0 0 0                       y -0.523599 0.523599  12   0.865
"""
_FOOT = (
    '<geom type="box" size="0.045 0.052 0.005" pos="0.04 0 -0.045"/>'
    '<geom type="box" size="0.028 0.052 0.005" pos="-0.045 0 -0.0555"/>'
    '<geom type="cylinder" size="0.052 0.005" pos="0.122 0 -0.0555"/>'
)
_ROOTS = {"hi": (4.80787, "0.0073 0 -0.0485", HI), "kuavo": (22.1226, "-0.0185 0 0.193", KUAVO)}


def mjcf(name):
    """The model file of "hi" or "kuavo"."""
    mass, middle, table = _ROOTS[name]
    links = {row.split()[0]: row.split()[1:] for row in table.strip().splitlines()}
    whole = links | {_other(link): _mirrored(row) for link, row in links.items() if _other(link) != link}

    def body(link):
        _, x, y, z, axis, lower, upper, effort, weight = whole[link]
        joint = (
            f'<joint name="{link.removesuffix("_link")}_joint" axis="{AXES[axis]}" range="{lower} {upper}" '
            f'actuatorfrcrange="-{effort} {effort}"/>'
        )
        surface = _FOOT if link in ("leg_l6_link", "leg_r6_link") else ""
        inertial = _inertial(float(weight), _middle(link))
        return f'<body name="{link}" pos="{x} {y} {z}">{joint}{inertial}{surface}{inside(link)}</body>'

    def inside(parent):
        return "".join(body(link) for link, row in whole.items() if row[0] == parent)

    def _middle(link):
        """The middle between a link and the next; of the last ones, a little below or above."""
        after = [row[1:4] for row in whole.values() if row[0] == link]
        return (
            " ".join(str(float(v) / 2) for v in after[0])
            if after
            else ("0 0 0.05" if "head" in link else "0.03 0 -0.03")
        )

    return (
        f'<mujoco model="{name}"><compiler angle="radian" autolimits="true"/><worldbody><body name="base_link" pos="0 0 1">'
        f'<freejoint/><site name="imu"/>{_inertial(mass, middle)}{inside("base_link")}</body></worldbody></mujoco>'
    )


def _other(link):
    return link.replace("leg_l", "leg_r").replace("zarm_l", "zarm_r") if link[0] in "lz" and "_l" in link[:6] else (
        "r_" + link[2:] if link.startswith("l_") else link
    )  # fmt: skip


def _mirrored(row):
    parent, x, y, z, axis, lower, upper, *rest = row
    if axis != "y":
        lower, upper = str(-float(upper)), str(-float(lower))
    return [_other(parent), x, str(-float(y)), z, axis, lower, upper, *rest]


def _inertial(mass, at):
    ball = 0.4 * mass * (0.06 * mass ** (1 / 3)) ** 2
    return f'<inertial mass="{mass}" pos="{at}" diaginertia="{ball} {ball} {ball}"/>'
