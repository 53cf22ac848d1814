#!/usr/bin/env bash
# The pinned set with its hashes, one file per Python, and a bill of materials: by pip-tools and CycloneDX.
# On a machine with these Pythons: scripts/lock.sh python3.11 python3.12. Take torch's CPU build from its makers' index first.
set -euo pipefail
cd "$(dirname "$0")/.."
for python in "$@"; do
  tag=py$("$python" -c 'import sys; print("%d%d" % sys.version_info[:2])')
  tools=$(mktemp -d)
  "$python" -m venv "$tools"
  "$tools/bin/pip" -q install pip-tools cyclonedx-bom
  "$tools/bin/pip-compile" --quiet --generate-hashes --strip-extras --allow-unsafe --no-annotate --no-emit-index-url \
    --no-emit-trusted-host --no-emit-find-links --extra train --extra deploy --extra c3d --extra film --extra view --extra music --extra sim2sim \
    -c tested-versions.txt pyproject.toml -o "locks/$tag.txt"
  "$tools/bin/cyclonedx-py" requirements "locks/$tag.txt" --pyproject pyproject.toml --mc-type application \
    --output-reproducible -o locks/sbom.cdx.json
  rm -rf "$tools"
done
