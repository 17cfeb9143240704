#!/usr/bin/env bash
# Make a virtual environment with andabata and its tools, and the system libraries that open3d needs.
# Usage: APT_PACKAGES="..." .ci/setup.sh PYTHON VENV
set -euo pipefail
python=$1
venv=$2

command -v "$python" >/dev/null || python=python3
if ! "$python" -c 'import sys; sys.exit(sys.version_info[:2] != (3, 11))'; then
  echo "error: expected Python 3.11, got $("$python" --version 2>&1); run make with PYTHON=/path/to/python3.11" >&2
  exit 1
fi

[ -x "$venv/bin/python" ] || "$python" -m venv "$venv"
echo "installing andabata and its packages into $venv (some minutes the first time)"
"$venv/bin/python" -m pip install --quiet --editable ".[dev]"

if ! "$venv/bin/python" -c 'import open3d' 2>/dev/null; then
  # open3d needs system libraries.
  bash "$(dirname "${BASH_SOURCE[0]}")/apt.sh" $APT_PACKAGES
  "$venv/bin/python" -c 'import open3d'
fi

# Compiled once, by the content of the sources: another clone of them finds its kernels compiled.
echo "compiling the kernels of a drive (a minute the first time)"
report=$("$venv/bin/andabata" doctor --compile --quiet) || printf '%s\n' "$report" >&2
