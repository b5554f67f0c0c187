#!/usr/bin/env bash
# Renders random scenes for a while and checks all that nacre promises of them.
set -euo pipefail

usage() {
  cat <<'END'
usage: tools/soak.sh MINUTES [FIRST_SEED]

Makes up scenes (shapes, media, surfaces, lights, cameras, options), bakes and renders them one after the other in one
process, and checks: the error of the hierarchical sum against the exact one, finite pixels, the same bits on one
thread and in crops, errors of one line, memory that does not grow. FIRST_SEED (0) is the number of the first scene;
the same number makes the same scene. What breaks a promise is left in build/soak, with its scene.
Exit 0: all held. 1: something did not. 2: usage.
END
}

case "${1:-}" in
  -h | --help) usage; exit 0 ;;
  "" | *[!0-9.]*) usage >&2; exit 2 ;;
esac
root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
cd "$root"
[[ -f build/release/build.ninja ]] || cmake --preset release >/dev/null
cmake --build build/release --target nacre_soak >/dev/null
mkdir -p build/soak
exec build/release/tests/soak/nacre_soak "$1" "${2:-0}" build/soak
