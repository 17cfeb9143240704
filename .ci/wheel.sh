#!/usr/bin/env bash
# Install the wheel in a new folder by the lines of docs/install.md, and run what it installs.
# Usage: .ci/wheel.sh PYTHON
set -euo pipefail
python=$1
home=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
command -v "$python" >/dev/null || python=python3
cp -r "$home/dist" "$home/constraints.txt" "$folder"
cd "$folder"

"$python" -m venv .venv
.venv/bin/pip install --constraint constraints.txt --no-deps --index-url https://download.pytorch.org/whl/cpu torch ||
  echo "torch without CUDA: skipped, its index has none for this Python or cannot be reached"
.venv/bin/pip install --constraint constraints.txt dist/andabata-0.1.0-py3-none-any.whl
.venv/bin/andabata doctor --self-test
.venv/bin/andabata drive --time-limit 10 --record drive.mcap
.venv/bin/andabata bag export drive.mcap --out tracks --clouds ply --quiet
.venv/bin/andabata scan "$(find tracks -name 'points_relative_*.ply' | sort | tail -1)"
.venv/bin/andabata demo --set trials=1 --set episodes=8 --quiet
du -sh .venv
