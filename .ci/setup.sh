#!/usr/bin/env bash
# Make a virtual environment with andabata and its tools, in the versions of constraints.txt, and the
# system libraries that open3d needs. torch comes from TORCH_INDEX where that can be reached: the
# usual index has torch with CUDA, some gigabytes more.
# Usage: APT_PACKAGES="..." TORCH_INDEX=URL .ci/setup.sh PYTHON VENV
set -euo pipefail
python=$1
venv=$2

command -v "$python" >/dev/null || python=python3
if ! "$python" -c 'import sys; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 13))'; then
  echo "error: expected Python 3.11, 3.12 or 3.13, got $("$python" --version 2>&1); run make with PYTHON=/path/to/python3.11" >&2
  exit 1
fi

[ -x "$venv/bin/python" ] || "$python" -m venv "$venv"
echo "installing andabata and its packages into $venv (some minutes the first time)"
pip=("$venv/bin/python" -m pip install --quiet --constraint constraints.txt)
if [ -n "${TORCH_INDEX:-}" ]; then
  "${pip[@]}" --no-deps --retries 0 --timeout 10 --index-url "$TORCH_INDEX" torch 2>/dev/null ||
    echo "torch: $TORCH_INDEX has none for this Python or cannot be reached; it comes from the usual index"
fi
"${pip[@]}" --editable ".[dev]"

if ! "$venv/bin/python" -c 'import open3d' 2>/dev/null; then
  # open3d needs system libraries.
  bash "$(dirname "${BASH_SOURCE[0]}")/apt.sh" $APT_PACKAGES
  "$venv/bin/python" -c 'import open3d'
fi

# Compiled once, by the content of the sources: another clone of them finds its kernels compiled.
echo "compiling the kernels of a drive (a minute the first time)"
report=$("$venv/bin/andabata" doctor --compile --quiet) || printf '%s\n' "$report" >&2
