"""A run on several dances as one tracker that knows them: python scripts/make_repertoire.py RUN FOLDER --credits WHOSE.

Writes policy.onnx, contract.json and the dances in few bits (rehearsal.npz): what dance-play FOLDER --dance NAME plays.
"""

from __future__ import annotations

import argparse
import shutil
from dataclasses import replace
from pathlib import Path

from tracking import REHEARSAL, read_contract
from tracking.policy import CONTRACT, POLICY, REFERENCE, write_contract
from tracking.task import read_named_reference, write_rehearsal_set


def main() -> None:
    """Take the policy of the first dance, for all have the same, and the references of all."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("run", type=Path)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--credits", required=True, help="whose motions they are, and under which licences")
    parser.add_argument("--only", nargs="*", default=[], help="the dances that are named, where the run knows more")
    args = parser.parse_args()
    bundles = sorted(p.parent for p in args.run.glob(f"*/{CONTRACT}"))
    if absent := set(args.only) - {b.name for b in bundles}:
        raise SystemExit(f"--only: no {', '.join(sorted(absent))} in {args.run}")
    bundles = [b for b in bundles if not args.only or b.name in args.only]
    args.folder.mkdir(parents=True, exist_ok=True)
    shutil.copyfile(bundles[0] / POLICY, args.folder / POLICY)
    contract = replace(read_contract(bundles[0] / CONTRACT), reference_sha256="")
    write_contract(args.folder / CONTRACT, contract)
    pieces = [replace(read_named_reference(b / REFERENCE), name=b.name) for b in bundles]
    write_rehearsal_set(args.folder / REHEARSAL, pieces, args.credits)
    print(f"{args.folder}: {', '.join(p.name for p in pieces)}")


if __name__ == "__main__":
    main()
