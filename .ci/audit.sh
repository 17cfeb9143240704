#!/usr/bin/env bash
# Look up the packages of a virtual environment in the database of known vulnerabilities; skipped,
# with the reason, where it cannot be reached. The environment itself is only read: pip-audit gets
# one of its own, which is thrown away.
# Usage: .ci/audit.sh VENV
set -euo pipefail
venv=$1
# A mirror may answer for a package and know nothing of its vulnerabilities.
database=https://pypi.org/pypi/numpy/2.0.0/json

probe='import json, sys, urllib.request
answer = json.load(urllib.request.urlopen(sys.argv[1], timeout=10))
sys.exit(None if "vulnerabilities" in answer else "its answer has no vulnerabilities")'
if ! reason=$("$venv/bin/python" -c "$probe" "$database" 2>&1); then
  echo "pip-audit: skipped, $database cannot be used: ${reason##*$'\n'}"
  exit 0
fi
packages=$("$venv/bin/python" -c 'import sysconfig; print(sysconfig.get_path("purelib"))')
own=$(mktemp -d)
trap 'rm -rf "$own"' EXIT
"$venv/bin/python" -m venv "$own"
"$own/bin/python" -m pip install --quiet 'pip-audit>=2.9,<3'
"$own/bin/pip-audit" --path "$packages" --skip-editable --progress-spinner off
