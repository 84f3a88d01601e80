#!/usr/bin/env bash
# Installs what Lucerna is built from and runs on, on Debian 12. Packages that are there already
# cost nothing: without a missing one, apt-get is not run.
set -euo pipefail

packages=(
  g++ cmake ninja-build ccache mold pkg-config dpkg-dev file
  libgrpc++-dev libprotobuf-dev protobuf-compiler protobuf-compiler-grpc libssl-dev
  libembree-dev libtbb-dev
  libopenexr-dev libstb-dev zlib1g-dev
  openssl libspdlog-dev libzstd-dev libcli11-dev nlohmann-json3-dev libsqlite3-dev
  libpugixml-dev libtinyobjloader-dev prometheus-cpp-dev libcpp-httplib-dev libsystemd-dev
)
if [ "${1:-}" = tests ]; then
  packages+=(libgtest-dev libgmock-dev libbenchmark-dev chromium clang-format clang-tidy groff-base mandoc prometheus
    python3 python3-grpcio python3-ipykernel python3-jsonschema python3-nbclient python3-nbformat python3-numpy
    python3-protobuf python3-venv python3-yaml)
fi

missing=()
for package in "${packages[@]}"; do
  dpkg-query --show --showformat '${db:Status-Status}\n' "$package" 2>/dev/null |
    grep --quiet '^installed$' || missing+=("$package")
done
if [ ${#missing[@]} -gt 0 ]; then
  as_root=()
  [ "$(id -u)" = 0 ] || as_root=(sudo)
  echo "installing ${#missing[@]} packages: ${missing[*]}"
  "${as_root[@]}" apt-get update --quiet
  DEBIAN_FRONTEND=noninteractive "${as_root[@]}" apt-get install --yes --quiet \
    --no-install-recommends "${missing[@]}"
fi
