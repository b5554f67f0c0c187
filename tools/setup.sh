#!/usr/bin/env bash
# Installs the Debian packages that nacre is built, tested and fed with.
set -euo pipefail

usage() {
  cat <<'END'
usage: tools/setup.sh [--tests]

Installs what is missing of the Debian 12 packages that nacre needs; needs root or sudo only then. --tests
adds what only tests use: without it, those that need it are skipped.
npm, which fetches the meshes of the example scenes, is installed only if it and the meshes are missing.
END
}

case "${1:-}" in
  "" | --tests) ;;
  -h | --help) usage; exit 0 ;;
  *) usage >&2; exit 2 ;;
esac

packages=(
  g++ cmake ninja-build ccache pkg-config time
  libembree-dev libopenmesh-dev libflann-dev liblz4-dev libopenexr-dev libimath-dev libtbb-dev libhwy-dev
  libpugixml-dev libcli11-dev nlohmann-json3-dev libfmt-dev zlib1g-dev libxxhash-dev libstb-dev libeigen3-dev libgtest-dev
  libbenchmark-dev
)
if [[ "${1:-}" == --tests ]]; then
  packages+=(chromium slurmctld slurmd slurm-client munge)
fi

# Those of the named packages that are not installed, one a line.
missing() {
  local name
  for name in "$@"; do
    [[ "$(dpkg-query -W -f='${db:Status-Status}\n' "$name" 2>/dev/null)" == *installed* ]] || echo "$name"
  done
}

as_root() {
  if ((EUID == 0)); then
    env DEBIAN_FRONTEND=noninteractive "$@"
  else
    sudo env DEBIAN_FRONTEND=noninteractive "$@"
  fi
}

install() {
  as_root apt-get install -y -qq --no-install-recommends "$@" >/dev/null
}

root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
mapfile -t needed < <(missing "${packages[@]}")
npm=()
if ! command -v npm >/dev/null && ! "$root/tools/fetch_meshes.sh" --check; then
  npm=(nodejs npm)
fi
if ((${#needed[@]} + ${#npm[@]} == 0)); then
  echo "setup: every package is installed"
  exit 0
fi

if ! command -v apt-get >/dev/null; then
  echo "setup: needs apt-get; install these packages some other way: ${needed[*]} ${npm[*]}" >&2
  exit 1
fi
if ((EUID != 0)) && ! command -v sudo >/dev/null; then
  echo "setup: needs root or sudo to install: ${needed[*]} ${npm[*]}" >&2
  exit 1
fi
echo "setup: installing ${needed[*]} ${npm[*]}"
as_root apt-get update -qq || echo "setup: apt-get update failed; trying with the package lists there are" >&2
if ((${#needed[@]} > 0)) && ! install "${needed[@]}"; then
  echo "setup: apt-get could not install ${needed[*]}; its message is above" >&2
  exit 1
fi
# Without npm everything works but the scenes with fetched meshes.
if ((${#npm[@]} > 0)) && ! install "${npm[@]}"; then
  echo "setup: npm could not be installed; the meshes of the example scenes cannot be fetched" >&2
fi
