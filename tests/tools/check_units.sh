#!/bin/sh
# Are the units of deploy/systemd what systemd takes?
#   check_units.sh FOLDER_OF_PROGRAMS
# 77 where systemd-analyze is missing.
set -eu
root=$(cd "$(dirname "$0")/../.." && pwd)
if ! command -v systemd-analyze >/dev/null; then
  echo "systemd-analyze is missing: the units are not checked"
  exit 77
fi
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
for unit in "$root"/deploy/systemd/*.service; do
  # As installed, but for where the programs are.
  sed "s|/usr/bin/lucerna|$1/lucerna|" "$unit" >"$folder/$(basename "$unit")"
done
said=$(systemd-analyze verify --man=no "$folder"/*.service 2>&1) || { echo "$said"; exit 1; }
# Warnings too.
if [ -n "$said" ]; then echo "$said"; exit 1; fi
