"""For which machines and Pythons the tested set has wheels, extra by extra, without installing anything: `make wheels`.

Asks the package index for the files of every pinned release and prints what an extra leaves out on a machine, by the markers in
pyproject.toml; fails where it leaves in what has no wheel there. `--index URL` asks another index.
"""

from __future__ import annotations

import argparse
import json
import sys
import urllib.request
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from importlib.metadata import PackageNotFoundError, requires
from pathlib import Path

from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet
from packaging.tags import Tag, compatible_tags, cpython_tags, mac_platforms
from packaging.utils import canonicalize_name, parse_wheel_filename

ROOT = Path(__file__).resolve().parent.parent
PYTHONS = ((3, 11), (3, 12), (3, 13), (3, 14))
MACHINES: dict[str, tuple[list[str], dict[str, str]]] = {  # name -> tags of its platform, what markers ask
    "Linux x86-64": (
        [f"manylinux_2_{n}_x86_64" for n in range(39, 4, -1)] + ["manylinux2014_x86_64", "manylinux2010_x86_64", "linux_x86_64"],
        {"sys_platform": "linux", "platform_system": "Linux", "platform_machine": "x86_64", "os_name": "posix"},
    ),
    "Linux aarch64": (
        [f"manylinux_2_{n}_aarch64" for n in range(39, 16, -1)] + ["manylinux2014_aarch64", "linux_aarch64"],
        {"sys_platform": "linux", "platform_system": "Linux", "platform_machine": "aarch64", "os_name": "posix"},
    ),
    "macOS arm64": (
        list(mac_platforms((15, 0), "arm64")),
        {"sys_platform": "darwin", "platform_system": "Darwin", "platform_machine": "arm64", "os_name": "posix"},
    ),
    "Windows x86-64": (
        ["win_amd64"],
        {"sys_platform": "win32", "platform_system": "Windows", "platform_machine": "AMD64", "os_name": "nt"},
    ),
}  # fmt: skip
EXTRAS = ("", "train", "sim2sim", "deploy", "c3d", "film", "scale", "robots")  # "": the package itself


def main() -> int:
    """Print the table; 1 where a wheel is missing, 0 with a word where nobody answers."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--index", default="https://pypi.org/simple")
    args = parser.parse_args()
    pins = _pins()
    try:
        with ThreadPoolExecutor(8) as pool:
            files = dict(zip(pins, pool.map(lambda name: _files(args.index, name, pins[name]), pins), strict=True))
    except (OSError, ValueError) as e:  # nobody there, or no index that answers in JSON
        sys.stdout.write(f"not checked: {args.index} does not answer ({e})\n")
        return 0
    gaps = 0
    for machine in MACHINES:
        for python in PYTHONS:
            said = dict[str, None]()  # each once, in order
            for extra in EXTRAS:
                needed = _needed(extra, machine, python)
                missing = [n for n in sorted(needed & pins.keys()) if not _fits(files[n], machine, python)]
                left_out = sorted(_asked(extra, "Linux x86-64", (3, 11)) - _asked(extra, machine, python))
                gaps += len(missing)
                said |= dict.fromkeys(
                    [f"NO WHEEL of {name}" for name in missing] + [f"without {name}" for name in left_out]
                )
            sys.stdout.write(f"{machine:<15} {_word(python)}  {'; '.join(said) or 'everything'}\n")
    return int(gaps > 0)


def _word(python: tuple[int, int]) -> str:
    return f"{python[0]}.{python[1]}"


def _pins() -> dict[str, str]:
    lines = (ROOT / "tested-versions.txt").read_text().split()
    return {canonicalize_name(name): version for name, version in (line.split("==") for line in lines if "==" in line)}


def _files(index: str, name: str, version: str) -> tuple[tuple[str, str], ...]:
    """The files of one release, as the index lists them, and the Pythons they are for."""
    asked = urllib.request.Request(f"{index}/{name}/", headers={"Accept": "application/vnd.pypi.simple.v1+json"})
    with urllib.request.urlopen(asked, timeout=30) as answer:
        listed = [(file["filename"], file.get("requires-python") or "") for file in json.load(answer)["files"]]
    return tuple((f, p) for f, p in listed if f.split("-")[1:2] == [version] or f.endswith(f"-{version}.tar.gz"))


@cache
def _tags(machine: str, python: tuple[int, int]) -> set[Tag]:
    platforms = MACHINES[machine][0]
    return {*cpython_tags(python, platforms=platforms), *compatible_tags(python, platforms=platforms)}


@cache
def _fits(files: tuple[tuple[str, str], ...], machine: str, python: tuple[int, int]) -> bool:
    """Whether a wheel installs there; a release of sources alone is built anywhere."""
    meant = [file for file, pythons in files if SpecifierSet(pythons).contains(f"{_word(python)}.0")]
    wheels = [file for file in meant if file.endswith(".whl")]
    if not any(file.endswith(".whl") for file, _ in files):
        return bool(meant)
    return any(parse_wheel_filename(file)[3] & _tags(machine, python) for file in wheels)


def _needed(extra: str, machine: str, python: tuple[int, int]) -> set[str]:
    """The pinned packages that an extra needs on a machine, and those that these need."""
    needed, asked = set[str](), [("dance-retarget", extra)]
    while asked:
        name, its_extra = asked.pop()
        for requirement in _requirements(name, its_extra, machine, python):
            other = canonicalize_name(requirement.name)
            if other not in needed:
                needed.add(other)
                asked += [(other, more) for more in ("", *requirement.extras)]
    return needed - {"dance-retarget"}


def _asked(extra: str, machine: str, python: tuple[int, int]) -> set[str]:
    """The packages that an extra asks for itself."""
    return {canonicalize_name(r.name) for r in _requirements("dance-retarget", extra, machine, python)}


@cache
def _told(name: str) -> tuple[Requirement, ...]:
    """What an installed package needs; nothing of one that is for other machines."""
    try:
        return tuple(map(Requirement, requires(name) or []))
    except PackageNotFoundError:
        return ()


def _requirements(name: str, extra: str, machine: str, python: tuple[int, int]) -> Iterator[Requirement]:
    world = {**MACHINES[machine][1], "python_version": _word(python), "python_full_version": f"{_word(python)}.0",
             "implementation_name": "cpython", "platform_python_implementation": "CPython", "extra": extra}  # fmt: skip
    for requirement in _told(name):
        if requirement.marker is None or requirement.marker.evaluate(world):
            yield requirement


if __name__ == "__main__":
    sys.exit(main())
