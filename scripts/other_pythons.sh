#!/usr/bin/env bash
# The fast tests that need no torch, on other Pythons of this machine: all that are found, or with `newest` that one.
# scripts/other_pythons.sh [newest]; wants dist/*.whl (make wheel).
set -euo pipefail
cd "$(dirname "$0")/.."

found=()
for version in 3.12 3.13 3.14; do
  for python in "python$version" "${PYENV_ROOT:-$HOME/.pyenv}"/versions/"$version".*/bin/python; do
    if "$python" -c "import sys; sys.exit('%d.%d' % sys.version_info[:2] != '$version')" 2> /dev/null; then
      found+=("$python")
      break
    fi
  done
done
if [ ${#found[@]} -eq 0 ]; then
  echo "no other Python on this machine: nothing tested"
  exit 0
fi
if [ "${1:-}" = newest ]; then found=("${found[-1]}"); fi

wheel=(dist/*.whl)
for python in "${found[@]}"; do
  echo "== $("$python" --version)"
  room=$(mktemp -d)
  trap 'rm -rf "$room"' EXIT
  "$python" -m venv "$room"
  if ! "$room/bin/python" -m pip --disable-pip-version-check -q install -c tested-versions.txt "${wheel[0]}[robots,c3d]" \
    pytest pytest-xdist beartype hypothesis PyYAML packaging; then
    echo "its packages cannot be had here: not tested (make wheels says what the index has)"
    continue
  fi
  "$room/bin/python" -m pytest -q -n auto --maxprocesses 4 --dist loadfile -p no:cacheprovider tests/robot_models tests/clips tests/retarget tests/cli/test_doctor.py
  rm -rf "$room"
done
