#!/usr/bin/env bash
# Run tests on a Python newer than the reference; skipped, with the reason, where there is none.
# Usage: APT_PACKAGES="..." TORCH_INDEX=URL .ci/newer_python.sh VENV TEST...
set -euo pipefail
venv=$1
shift

# Return the path of a version that is on PATH, or that pyenv has though it is not chosen there.
find_python() {
  local version
  "python$1" -c 'import sys; print(sys.executable)' 2>/dev/null && return
  version=$(pyenv latest "$1" 2>/dev/null) && echo "$(pyenv prefix "$version")/bin/python"
}

python=$(find_python 3.13 || find_python 3.12) || {
  echo "newer Python: skipped, found neither python3.13 nor python3.12 on PATH or in pyenv"
  exit 0
}
free=$(df --output=avail -BG . | tail -1 | tr -dc 0-9)
if [ "$free" -lt 20 ]; then
  echo "newer Python: skipped, expected 20 GB free for torch with CUDA, got $free GB"
  exit 0
fi
bash "$(dirname "${BASH_SOURCE[0]}")/setup.sh" "$python" "$venv"
echo "tests on $("$venv/bin/python" --version)"
"$venv/bin/python" -m pytest -n 2 --dist worksteal -q "$@"
