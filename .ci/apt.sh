#!/usr/bin/env bash
# Install Debian packages, as root or with a sudo that asks nothing.
# Usage: .ci/apt.sh PACKAGE...
set -euo pipefail
install="apt-get install -y $*"
if ! command -v apt-get >/dev/null; then
  echo "error: expected apt-get to install these packages (Debian's names): $*" >&2
  exit 1
elif [ "$(id -u)" -eq 0 ]; then
  (apt-get update -qq && DEBIAN_FRONTEND=noninteractive $install -qq) >/dev/null
elif sudo -n true 2>/dev/null; then
  (sudo -n apt-get update -qq && sudo -n DEBIAN_FRONTEND=noninteractive $install -qq) >/dev/null
else
  echo "error: system packages are missing; run: sudo $install" >&2
  exit 1
fi
