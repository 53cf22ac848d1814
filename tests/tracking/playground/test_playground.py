"""A policy's page: the same physics, the same network, everything in one file; and what it cannot show is refused."""

import base64
import gzip
import json
import re

import mujoco
import numpy as np
import pytest

pytest.importorskip("torch")
onnx = pytest.importorskip("onnx")

import tracking.playground.page
from clips import OutputError
from robot_models import load_robot
from tracking import TrackingError, load_bundle
from tracking.engines import training_model
from tracking.playground import save_playground
from tracking.playground.model_xml import model_xml
from tracking.playground.network import layers_of
from tracking.policy import SHIPPED, onnx_policy


@pytest.mark.parametrize("name", ["dancer", "g1"])
def test_the_written_model_moves_as_the_one_that_it_was_written_from(name):
    robot = load_robot(name)
    ours = training_model(robot, 0.005)
    again = mujoco.MjModel.from_xml_string(model_xml(ours, robot.kp, robot.kd))
    again.opt.disableflags = ours.opt.disableflags
    one, other = mujoco.MjData(ours), mujoco.MjData(again)
    for data in (one, other):
        data.qpos[:] = robot.default_qpos
    for k in range(200):  # long enough to stand, step and fall
        for data in (one, other):
            data.ctrl[:] = robot.default_joint_pos + 0.2 * np.sin(0.05 * k + np.arange(ours.nu))
        mujoco.mj_step(ours, one)
        mujoco.mj_step(again, other)
    np.testing.assert_allclose(other.qpos, one.qpos, atol=1e-9)
    assert np.abs(one.qpos - robot.default_qpos).max() > 0.1  # it did move


def computed(layers, x):
    for layer in layers:
        if layer["kind"] == "affine":
            x = (x - layer["shift"]) / layer["scale"]
        elif layer["kind"] == "dense":
            x = layer["weight"] @ x + layer["bias"]
        else:
            x = {"elu": lambda v: np.where(v > 0, v, np.expm1(v)), "tanh": np.tanh, "relu": lambda v: np.maximum(v, 0)}[
                layer["kind"]
            ](x)
    return x


@pytest.mark.parametrize("name", ["groove-dancer", "groove-g1", "tracker-g1", "tracker-dancer", "repertoire-g1"])
def test_the_layers_are_the_network(name, rng):
    path = SHIPPED / name / "policy.onnx"
    layers = layers_of(path)
    assert [layer["kind"] for layer in layers] == ["affine", "dense", "elu", "dense", "elu", "dense"]
    seen = rng.normal(size=len(layers[0]["shift"])).astype(np.float32)
    np.testing.assert_allclose(computed(layers, seen), onnx_policy(path)(seen[None])[0], atol=1e-4)


def test_a_network_that_branches_is_refused(tmp_path):
    given, out = (onnx.helper.make_tensor_value_info(n, onnx.TensorProto.FLOAT, [1, 3]) for n in ("obs", "out"))
    node = onnx.helper.make_node("Add", ["obs", "obs"], ["out"])
    onnx.save(onnx.helper.make_model(onnx.helper.make_graph([node], "g", [given], [out])), str(tmp_path / "a.onnx"))
    with pytest.raises(TrackingError, match="Add"):
        layers_of(tmp_path / "a.onnx")


@pytest.fixture
def built(tmp_path, monkeypatch):
    """Doubles of the parts that are built from JavaScript."""
    folder = tmp_path / "built"
    folder.mkdir()
    (folder / "playground.js").write_text('console.log("</script> %DANCE%")')
    (folder / "mujoco.wasm.gz").write_bytes(gzip.compress(b"physics"))
    monkeypatch.setattr(tracking.playground.page, "BUILT", folder)
    return folder


def test_everything_is_in_the_file_and_nothing_is_fetched(built, tmp_path):
    bundle = load_bundle("groove-dancer")
    save_playground(tmp_path / "a.html", bundle, "a < b")
    text = (tmp_path / "a.html").read_text()
    assert "a &lt; b" in text and not re.findall(r"%[A-Z]+%", text.split('<script type="module">')[0])
    assert not re.findall(r"""(?:src|href)=["']?(?:https?:)?//""", text)
    assert text.count("</script>") == 3  # none that ends it early
    told = json.loads(gzip.decompress(base64.b64decode(re.search(r'id="dance">([^<]+)<', text).group(1))))
    assert told["substeps"] == 4 and len(told["order"]) == len(bundle.contract.joint_names)
    qpos = np.frombuffer(base64.b64decode(told["qpos"]["f32"]), dtype="<f4").reshape(bundle.reference.frames, -1)
    np.testing.assert_allclose(qpos, bundle.reference.qpos, atol=1e-5)
    save_playground(tmp_path / "b.html", bundle, "a < b")
    assert (tmp_path / "b.html").read_bytes() == (tmp_path / "a.html").read_bytes()


def test_without_its_parts_it_says_how_to_build_them(tmp_path, monkeypatch):
    monkeypatch.setattr(tracking.playground.page, "BUILT", tmp_path / "none")
    with pytest.raises(OutputError, match="make web"):
        save_playground(tmp_path / "a.html", load_bundle("groove-dancer"), "a")
    assert not (tmp_path / "a.html").exists()


def test_the_pages_rows_are_those_that_the_script_computes():
    script = (tracking.playground.page.BUILT.parent / "web" / "src" / "policy.js").read_text()
    assert tuple(re.findall(r'case "(\w+)"', script)) == tracking.playground.page._KINDS
