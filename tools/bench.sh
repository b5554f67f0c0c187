#!/usr/bin/env bash
# Builds the benchmarks and runs them.
set -euo pipefail

usage() {
  cat <<'END'
usage: tools/bench.sh [--quick | --full]

Builds build/bench and leaves there bench.md, tables of times and errors, and the figures in bench.json (frames and
bakes) and micro_bench.json (inner loops). Needs what tools/setup.sh and tools/fetch_meshes.sh provide, and a machine
with nothing else to do. --quick is a smoke test; --full measures caches of 10 million samples, too.
END
}

size=()
case "${1:-}" in
  "") ;;
  --quick | --full) size=("$1") ;;
  -h | --help) usage; exit 0 ;;
  *) usage >&2; exit 2 ;;
esac
if (($# > 1)); then usage >&2; exit 2; fi

root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
cd "$root"
if ! tools/fetch_meshes.sh --check; then
  echo "bench: the meshes are missing; run tools/fetch_meshes.sh" >&2
  exit 1
fi
bench=build/bench
cmake -S . -B "$bench" -G Ninja -DCMAKE_BUILD_TYPE=Release -DNACRE_BUILD_BENCH=ON -DNACRE_BUILD_TESTS=OFF
cmake --build "$bench" --target nacre_micro_bench nacre_frame_bench

"$bench/tests/bench/nacre_frame_bench" "${size[@]}" -o "$bench/bench.json" | tee "$bench/bench.md.part"
least_time=0.5
if [[ "${size[*]}" == --quick ]]; then least_time=0.01; fi
{
  printf '## Inner loops\n\n```\n'
  "$bench/tests/bench/nacre_micro_bench" --benchmark_min_time="$least_time" --benchmark_color=false \
    --benchmark_out="$bench/micro_bench.json" 2>/dev/null
  printf '```\n'
} | tee -a "$bench/bench.md.part"
mv "$bench/bench.md.part" "$bench/bench.md"
echo "bench: $bench/bench.md, $bench/bench.json, $bench/micro_bench.json"
