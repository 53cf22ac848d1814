"""A humanoid as body models are made into robots: three hinges on every body, toes and hands, ranges of half a turn."""

BODIES = {  # parent, offset [m]: x ahead, y left, z up
    "Pelvis": (None, (0, 0, 0.94)),
    **{
        name: parent_and_place
        for side, s in (("L", 1.0), ("R", -1.0))
        for name, parent_and_place in {
            f"{side}_Hip": ("Pelvis", (-0.01, 0.07 * s, -0.09)),
            f"{side}_Knee": (f"{side}_Hip", (0.0, 0.03 * s, -0.38)),
            f"{side}_Ankle": (f"{side}_Knee", (-0.03, -0.01 * s, -0.40)),
            f"{side}_Toe": (f"{side}_Ankle", (0.12, 0.03 * s, -0.05)),
        }.items()
    },
    "Torso": ("Pelvis", (-0.03, 0, 0.11)),
    "Spine": ("Torso", (0, 0, 0.13)),
    "Chest": ("Spine", (0.03, 0, 0.05)),
    "Neck": ("Chest", (-0.03, 0, 0.21)),
    "Head": ("Neck", (0.05, 0, 0.09)),
    **{
        name: parent_and_place
        for side, s in (("L", 1.0), ("R", -1.0))
        for name, parent_and_place in {
            f"{side}_Thorax": ("Chest", (-0.02, 0.08 * s, 0.11)),
            f"{side}_Shoulder": (f"{side}_Thorax", (-0.02, 0.12 * s, 0.04)),
            f"{side}_Elbow": (f"{side}_Shoulder", (-0.02, 0.26 * s, -0.01)),
            f"{side}_Wrist": (f"{side}_Elbow", (0.0, 0.25 * s, 0.01)),
            f"{side}_Hand": (f"{side}_Wrist", (-0.01, 0.08 * s, -0.01)),
        }.items()
    },
}
_BOXES = {"Ankle": ("0.085 0.05 0.03", "0.04 0 -0.03"), "Toe": ("0.04 0.045 0.02", "0.03 0 -0.01")}


def mjcf():
    """Its model file."""
    children = {name: [n for n, (parent, _) in BODIES.items() if parent == name] for name in BODIES}

    def body(name):
        _, place = BODIES[name]
        joints = '<freejoint name="root"/>' if name == "Pelvis" else "".join(
            f'<joint name="{name}_{axis}" axis="{way}" range="-3.1416 3.1416" armature="0.01"/>'
            for axis, way in (("x", "1 0 0"), ("y", "0 1 0"), ("z", "0 0 1"))
        )  # fmt: skip
        part = name.partition("_")[2]
        if part in _BOXES:
            size, at = _BOXES[part]
            shape = f'<geom type="box" size="{size}" pos="{at}" density="1000"/>'
        else:
            to = BODIES[children[name][0]][1] if children[name] else (0.0, 0.0, 0.05)
            shape = f'<geom type="capsule" size="0.04" fromto="0 0 0 {to[0]} {to[1]} {to[2]}" density="1000"/>'
        inside = "".join(map(body, children[name]))
        return f'<body name="{name}" pos="{place[0]} {place[1]} {place[2]}">{joints}{shape}{inside}</body>'

    motors = "".join(
        f'<motor name="{name}_{axis}" joint="{name}_{axis}" gear="300" ctrllimited="true" ctrlrange="-1 1"/>'
        for name in list(BODIES)[1:]
        for axis in "xyz"
    )
    return (
        '<mujoco model="smpl_like"><compiler angle="radian"/>'
        f"<worldbody>{body('Pelvis')}</worldbody><actuator>{motors}</actuator></mujoco>"
    )
