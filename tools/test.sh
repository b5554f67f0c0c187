#!/usr/bin/env bash
# Builds nacre from a bare Debian 12 and runs every test.
set -euo pipefail

usage() {
  cat <<'END'
usage: tools/test.sh [--sanitize] [CTEST OPTION ...]

Installs what is missing, fetches the meshes, builds build/release and runs the tests. Options are handed to
ctest: `-L unit` runs the tests of one label (unit, analytic, golden, image, cli), `-R NAME` those of a name.
--sanitize runs them all in builds with AddressSanitizer and UndefinedBehaviorSanitizer, and those of what runs in
threads in one with ThreadSanitizer: an hour or two on two cores.
END
}

presets=(release)
case "${1:-}" in
  -h | --help) usage; exit 0 ;;
  --sanitize) presets=(sanitize sanitize-threads); shift ;;
esac

root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
cd "$root"
tools/setup.sh --tests
status=0
tools/fetch_meshes.sh || status=$?
if ((status == 3)); then
  echo "test: going on without the meshes of the example scenes" >&2
elif ((status != 0)); then
  exit "$status"
fi
for preset in "${presets[@]}"; do
  cmake --preset "$preset"
  cmake --build --preset "$preset"
  ctest --preset "$preset" --parallel "$(nproc)" "$@"
done
