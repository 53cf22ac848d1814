"""`dance-verify` says of a reference what is true of it."""

import dataclasses

import cli.verify
from clips import MetricKey, load_reference, save_reference


def test_a_gate_that_failed_when_the_reference_was_made_is_named(groove_file, tmp_path, capsys):
    reference = load_reference(groove_file)
    report = {k: dict(v) for k, v in reference.meta["report"].items()}
    report[MetricKey.SELF_COLLISION] |= {"value": 32.0, "passed": False}
    broken = dataclasses.replace(reference, meta={**reference.meta, "report": report})
    save_reference(broken, tmp_path / "broken.npz")
    assert cli.verify.main([str(tmp_path / "broken.npz")]) == 1
    assert "missed when it was made: deepest self-collision" in capsys.readouterr().out
    assert cli.verify.main([str(groove_file)]) == 0  # the control: this one kept its gates
    assert "all held when it was made" in capsys.readouterr().out
