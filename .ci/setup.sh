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
  install="apt-get install -y $APT_PACKAGES"
  if ! command -v apt-get >/dev/null; then
    echo "error: open3d needs these system libraries (Debian's names): $APT_PACKAGES" >&2
    exit 1
  elif [ "$(id -u)" -eq 0 ]; then
    (apt-get update -qq && DEBIAN_FRONTEND=noninteractive $install -qq) >/dev/null
  elif sudo -n true 2>/dev/null; then
    (sudo -n apt-get update -qq && sudo -n DEBIAN_FRONTEND=noninteractive $install -qq) >/dev/null
  else
    echo "error: open3d needs system libraries; run: sudo $install" >&2
    exit 1
  fi
  "$venv/bin/python" -c 'import open3d'
fi
