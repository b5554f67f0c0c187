#!/usr/bin/env bash
# Measures how uniform samples are and plots it.
set -euo pipefail

usage() {
  cat <<'END'
usage: tools/plot_uniformity.sh [FOLDER]

Writes uniformity_spectrum.png and uniformity_blotch.png to FOLDER (default: docs), and leaves their figures in
build/bench/spectrum.csv and blotch.csv. Needs what tools/setup.sh provides; installs gnuplot-nox where there is
no gnuplot. Takes a minute or two.
END
}

case "${1:-}" in
  -h | --help) usage; exit 0 ;;
  -*) usage >&2; exit 2 ;;
esac
if (($# > 1)); then usage >&2; exit 2; fi

folder="$(realpath "${1:-$(dirname "${BASH_SOURCE[0]}")/../docs}")"
cd "$(dirname "${BASH_SOURCE[0]}")/.."
if ! command -v gnuplot >/dev/null; then
  as_root=()
  if ((EUID != 0)); then as_root=(sudo); fi
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends gnuplot-nox \
    >/dev/null
fi
bench=build/bench
cmake -S . -B "$bench" -G Ninja -DCMAKE_BUILD_TYPE=Release -DNACRE_BUILD_BENCH=ON -DNACRE_BUILD_TESTS=OFF >/dev/null
cmake --build "$bench" --target nacre_uniformity_bench
"$bench/tests/bench/nacre_uniformity_bench" "$bench"

gnuplot <<END
set datafile separator ','
set terminal pngcairo size 720,440 font 'sans,10' linewidth 1.5
set key autotitle columnhead
set grid
set logscale y
set border 3
set tics nomirror

set output '$folder/uniformity_spectrum.png'
set xlabel 'frequency, 1 / spacing'
set ylabel 'power (random points: 1)'
set xrange [0:2.4]
set yrange [1e-6:10]
set format y '10^{%T}'
set key bottom right
plot for [c = 2:7] '$bench/spectrum.csv' using 1:c with lines

set output '$folder/uniformity_blotch.png'
set logscale x
set xtics (0.4, 0.5, 0.65, 0.8, 1, 1.25, 1.6, 2)
set xlabel 'spacing, mean free paths'
set ylabel 'blotch, %'
set xrange [0.38:2.1]
set yrange [0.02:50]
set format y '%g'
set key bottom right
plot for [c = 2:8] '$bench/blotch.csv' using 1:c with linespoints pointsize 0.8
END
echo "plot_uniformity: $folder/uniformity_spectrum.png, $folder/uniformity_blotch.png"
