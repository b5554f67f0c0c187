#!/usr/bin/env bash
# Feeds every reader with files that chance and clang's libFuzzer make up.
set -euo pipefail

usage() {
  cat <<'END'
usage: tools/fuzz.sh SECONDS [TARGET ...]

Builds the fuzzers with clang, AddressSanitizer and UndefinedBehaviorSanitizer in build/fuzz and runs each for that
many seconds, two at a time, from the seeds in tests/fuzz/corpus and tests/golden. Prints a table. Inputs that crash,
hang for more than 20 seconds or take more than 2 GB are left in build/fuzz/found/TARGET; what new inputs taught it
is in build/fuzz/corpus/TARGET, from where the next run goes on. Targets are all of tests/fuzz/CMakeLists.txt.
Exit 0: nothing found. 1: something found. 2: usage.
END
}

case "${1:-}" in
  -h | --help) usage; exit 0 ;;
  "" | *[!0-9]*) usage >&2; exit 2 ;;
esac
seconds=$1
shift
root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
cd "$root"
targets=("$@")
if ((${#targets[@]} == 0)); then
  targets=(scene obj ply stl off serialized cache exitance cloud image bitmap plan_csv plan_json camera_path)
fi

if ! command -v clang++ >/dev/null; then
  echo "fuzz: needs clang: apt-get install clang" >&2
  exit 2
fi
[[ -f build/fuzz/build.ninja ]] || cmake --preset fuzz >/dev/null
mkdir -p build/fuzz
if ! cmake --build build/fuzz --target "${targets[@]/#/fuzz_}" >build/fuzz/build.log 2>&1; then
  tail -n 30 build/fuzz/build.log >&2
  echo "fuzz: the fuzzers do not build; see build/fuzz/build.log" >&2
  exit 2
fi

# What AddressSanitizer keeps of the memory that is free counts towards the limit.
export ASAN_OPTIONS="quarantine_size_mb=16:allocator_release_to_os_interval_ms=200:${ASAN_OPTIONS:-}"

# Golden files are seeds, too.
seeds_of() {
  echo "tests/fuzz/corpus/$1"
  case "$1" in
    scene) echo tests/golden/scenes ;;
    obj | ply | stl | off) echo tests/golden/meshes ;;
    cache) echo tests/golden/cache ;;
  esac
}

run() {
  local target=$1 log=build/fuzz/$1.log status=0
  local -a seeds=()
  mapfile -t seeds < <(seeds_of "$target")
  mkdir -p "build/fuzz/corpus/$target" "build/fuzz/found/$target" "tests/fuzz/corpus/$target"
  "build/fuzz/tests/fuzz/fuzz_$target" "build/fuzz/corpus/$target" "${seeds[@]}" -max_total_time="$seconds" \
    -rss_limit_mb=2048 -timeout=20 -max_len=65536 -print_final_stats=1 \
    -artifact_prefix="build/fuzz/found/$target/" >"$log" 2>&1 || status=$?
  local inputs
  inputs=$(sed -n 's/^stat::number_of_executed_units: *//p' "$log")
  if ((status == 0)); then
    printf '%-12s %10s inputs  %5s s  nothing found\n' "$target" "${inputs:-?}" "$seconds"
  else
    printf '%-12s %10s inputs  %5s s  FOUND: %s\n' "$target" "${inputs:-?}" "$seconds" \
      "$(grep -m1 -E 'ERROR|runtime error|not one line|terminate' "$log" || echo "see $log")"
    return 1
  fi
}

found=0
for ((i = 0; i < ${#targets[@]}; i += 2)); do
  run "${targets[i]}" &
  first=$!
  if ((i + 1 < ${#targets[@]})); then run "${targets[i + 1]}" || found=1; fi
  wait "$first" || found=1
done
exit "$found"
