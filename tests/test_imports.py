"""The house stands: floors, rooms in their order, no circle between files, nobody reaching past an `__init__`."""

import ast
import importlib
import subprocess
import sys
import tomllib
from functools import cache

import pytest
from conftest import ROOT

# Each floor imports only floors before it; each room or module of a floor only those before it in its floor.
HOUSE = {
    "robot_models": (
        "maths version errors incoming profile model model_file rigid_body build geometry visual surface variant "
        "catalogue draft"
    ),
    "clips": (
        "errors contact config files metrics provenance clip reference reference_file checks edit music identify readers writers"
    ),
    "retarget": "errors rules config targets dynamics solver per_frame report recordings stage pipeline workflows",
    "tracking": "errors config policy run_files engines task evaluation playground training teaching envs deploy",
    "cli": "shell recordings retargeting evaluating training deploying inspecting judging viewing *",
}
FLOORS = list(HOUSE)
MOST_MODULES, MOST_LINES = 12, 300  # of a folder (readers are one per format), of a module
LONGEST_OF_TEN, MEDIAN_LINES = 26, 110  # of ten functions nine are no longer; half of the modules


def files(*tops):
    return [path for top in tops for path in sorted((ROOT / top).rglob("*.py")) if "samples" not in path.parts]


def name_of(path):
    return ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")


@cache
def packages():
    return {name_of(path) for path in files(*FLOORS) if path.name == "__init__.py"} | {"clips.samples"}


@cache
def imports_of(path):
    """(module, name) of every import in a file, wherever it stands; the name is None for `import module`."""
    found = []
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            found += [(a.name, None) for a in node.names]
        elif isinstance(node, ast.ImportFrom) and node.module:
            found += [(node.module, a.name) for a in node.names]
    return found


def defined_in(module, name):
    """The module that an import leads to in the end: a room's `__init__` only hands on."""
    if name is not None and f"{module}.{name}" in {name_of(p) for p in files(*FLOORS)}:
        return f"{module}.{name}"
    if module in packages():
        init = ROOT / module.replace(".", "/") / "__init__.py"
        homes = [m for m, n in imports_of(init) if n == name and m.split(".")[0] in FLOORS]
        return defined_in(homes[0], name) if homes else module
    return module


def arrows(path):
    """Modules of the house that a file needs."""
    return {defined_in(m, n) for m, n in imports_of(path) if m.split(".")[0] in FLOORS} - {name_of(path)}


def place(module):
    """(floor, unit) as numbers: where a module stands in the house."""
    floor, _, rest = module.partition(".")
    units, unit = HOUSE[floor].split(), rest.split(".")[0]
    return FLOORS.index(floor), units.index(unit) if unit in units else units.index("*") if "*" in units else -1


@pytest.mark.parametrize("floor", FLOORS)
def test_floors_and_rooms_import_only_what_stands_below_them(floor):
    upward = [
        f"{name_of(path)} -> {other}"
        for path in files(floor)
        if path.name != "__init__.py"
        for other in arrows(path)
        if place(other) > place(name_of(path))
    ]
    assert not upward


def test_every_room_has_its_place_in_the_order():
    for floor, units in HOUSE.items():
        there = {p.stem for p in (ROOT / floor).glob("*.py")} | {
            p.parent.name for p in (ROOT / floor).glob("*/__init__.py")
        }
        assert "*" in units or there - {"__init__", "samples"} == set(units.split())


def circles(graph):
    """The modules of every circle."""
    done, found = set(), []

    def walk(module, way):
        if module in way:
            found.append(way[way.index(module) :])
        elif module not in done:
            for other in graph.get(module, ()):
                walk(other, [*way, module])
            done.add(module)

    for module in graph:
        walk(module, [])
    return found


def test_no_files_need_one_another():
    assert not circles({name_of(p): arrows(p) for p in files(*FLOORS) if p.name != "__init__.py"})
    assert circles({"a": {"b"}, "b": {"c"}, "c": {"b"}}) == [["b", "c"]]  # the negative control


def test_nobody_reaches_past_an_init():
    past = []
    for path in files(*FLOORS, "benchmarks", "scripts"):
        home = name_of(path) if path.name == "__init__.py" else name_of(path).rpartition(".")[0]
        for module, _ in imports_of(path):
            room = module if module in packages() else module.rpartition(".")[0]
            inside = home == room or home.startswith(f"{room}.")
            if module.split(".")[0] in FLOORS and module not in packages() and not inside:
                past.append(f"{name_of(path)} -> {module}")
    assert not past


def test_rooms_and_modules_stay_small():
    for folder in {path.parent for path in files(*FLOORS)}:
        modules = [p for p in folder.glob("*.py") if p.name != "__init__.py"]
        assert len(modules) <= MOST_MODULES or folder.name in ("readers", "cli"), folder
    for path in files(*FLOORS):
        assert len(path.read_text().splitlines()) <= MOST_LINES, path


def lengths():
    """Lines of every function, the shortest first."""
    trees = (ast.parse(path.read_text()) for path in files(*FLOORS))
    functions = (n for tree in trees for n in ast.walk(tree) if isinstance(n, ast.FunctionDef))
    return sorted(n.end_lineno - n.lineno + 1 for n in functions)


def test_functions_and_modules_tell_one_story():
    found = lengths()
    assert found[int(0.9 * len(found))] <= LONGEST_OF_TEN
    lines = sorted(len(path.read_text().splitlines()) for path in files(*FLOORS) if path.name != "__init__.py")
    assert lines[len(lines) // 2] <= MEDIAN_LINES


def test_torch_stays_in_tracking_and_rerun_in_one_module():
    for path in files(*FLOORS):
        names = {module.split(".")[0] for module, _ in imports_of(path)}
        assert "torch" not in names or path.parts[len(ROOT.parts)] == "tracking" or path.name == "torch_motion.py", path
        assert "rerun" not in names or path.name in ("scene.py", "blueprint.py", "marks.py"), path


@pytest.mark.parametrize(
    "package", sorted(p for p in packages() if p not in ("cli", "cli.recordings", "clips.samples"))
)
def test_every_public_name_exists(package):
    module = importlib.import_module(package)
    assert all(hasattr(module, name) for name in module.__all__)


@pytest.mark.parametrize(
    ("package", "heavy"),
    [
        ("retarget", "torch rerun mink placo pinocchio trimesh pandas mujoco"),
        ("tracking.policy", "torch mujoco pinocchio gymnasium sapien onnx rerun"),
        ("tracking.deploy", "torch mujoco pinocchio gymnasium sapien onnx rerun"),
    ],
)
def test_light_rooms_are_light_to_import(package, heavy):
    code = f"import sys, {package}; print([m for m in {heavy.split()} if m in sys.modules])"
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT, check=True).stdout
    assert out.strip() == "[]"


def test_a_command_parses_calls_one_function_and_reports():
    for path in (ROOT / "cli").glob("*.py"):
        assert len(path.read_text().splitlines()) <= 120, path
        assert "numpy" not in {module.split(".")[0] for module, _ in imports_of(path)}, path


def test_recordings_and_retargeting_do_without_the_training_packages():
    code = "import sys, retarget.recordings, cli.retarget; print([m for m in ('torch', 'tracking', 'rerun') if m in sys.modules])"
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=ROOT, check=True).stdout
    assert out.strip() == "[]"


def test_every_package_is_in_the_wheel():
    told = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["setuptools"]["packages"]
    assert set(told) == packages()
