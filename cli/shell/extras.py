"""The packages that each extra of the distribution brings, and what for."""

from __future__ import annotations

import platform
import sys

from robot_models import DanceError

# extra -> (distribution, module), what it is for
PARTS: dict[str, tuple[str, tuple[tuple[str, str], ...]]] = {
    "base": ("retargeting, recordings", (
        ("numpy", "numpy"), ("scipy", "scipy"), ("mujoco", "mujoco"), ("mink", "mink"), ("pin", "pinocchio"), ("placo", "placo"),
        ("rerun-sdk", "rerun"), ("trimesh", "trimesh"),
    )),
    "train": ("policies", (
        ("torch", "torch"), ("rsl-rl-lib", "rsl_rl"), ("gymnasium", "gymnasium"), ("tensorboard", "tensorboard"),
        ("onnx", "onnx"), ("onnxruntime", "onnxruntime"),
    )),
    "sim2sim": ("the second engine, sweeps", (("sapien", "sapien"), ("matplotlib", "matplotlib"), ("pyyaml", "yaml"))),
    "deploy": ("a robot's wires", (("far-unitree-sdk", "unitree_interface"),)),
    "robots": ("meshes of G1, JVRC-1, Talos", (("example-robot-data", ""), ("jvrc-description", ""))),
    "models": ("robots of collections", (("mujoco-menagerie", "mujoco_menagerie"), ("robot-descriptions", "robot_descriptions"))),
    "c3d": ("C3D recordings", (("ezc3d", "ezc3d"),)),
    "film": ("films of policies", (("imageio-ffmpeg", "imageio_ffmpeg"),)),
    "view": ("a dance in the browser", (("viser", "viser"), ("fast-simplification", "fast_simplification"))),
    "music": ("beats of a song", (("librosa", "librosa"), ("soundfile", "soundfile"), ("sounddevice", "sounddevice"))),
    "scale": ("batches on a cluster", (("ray", "ray"),)),
    "gpu": ("training on a GPU", (("mujoco-warp", "mujoco_warp"), ("warp-lang", "warp"))),
}  # fmt: skip


def made_for(
    distribution: str,
    system: str = sys.platform,
    machine: str = platform.machine(),
    python: tuple[int, int] = sys.version_info[:2],
) -> str:
    """The machines that a package has wheels for, where this is none of them; else "". `make wheels` asks the index."""
    on_unix, on_arm = system != "win32", machine == "aarch64"
    here, where = {
        "pin": (on_unix, "Linux and macOS"),
        "placo": (on_unix and python < (3, 14), "Linux and macOS, Python 3.13 at most"),
        "far-unitree-sdk": (system == "linux" and python < (3, 13), "Linux, Python 3.12 at most"),
        "sapien": (not on_arm, "machines but Linux on aarch64"),
        "ezc3d": (not on_arm, "machines but Linux on aarch64"),
    }.get(distribution, (True, ""))
    return "" if here else where


def extra_of(module: str) -> str | None:
    """The extra that brings a module of another package; None where no extra does."""
    top = module.partition(".")[0]
    for extra, (_, packages) in PARTS.items():
        if extra != "base" and top in {name for _, name in packages}:
            return extra
    return None


def refusal_of(error: ModuleNotFoundError) -> DanceError:
    """The refusal that names the extra; another missing package is a fault of ours, and stays a traceback."""
    extra = extra_of(error.name or "")
    if extra is None:
        raise error
    distribution = next(d for d, module in PARTS[extra][1] if module == (error.name or "").partition(".")[0])
    elsewhere = made_for(distribution)
    if elsewhere:
        return DanceError("this command", found=f"no package {distribution} for this machine", expected=elsewhere)
    return DanceError(
        "this command", found=f"no package {error.name}", expected=f"the extra {extra}",
        cure=f"pip install -c tested-versions.txt 'dance-retarget[{extra}]'",
    )  # fmt: skip
