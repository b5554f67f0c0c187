#!/usr/bin/env node
// Makes what the example scenes read beside themselves: scenes/studio.hdr and the meshes of scenes/shapes/.
"use strict";
const fs = require("fs");
const path = require("path");

if (process.argv.length > 2) {
  console.error("usage: tools/make_scene_files.js    writes scenes/studio.hdr and scenes/shapes/*.obj");
  process.exit(process.argv[2] === "--help" || process.argv[2] === "-h" ? 0 : 2);
}
const scenes = path.join(__dirname, "..", "scenes");

// ---- studio.hdr: soft boxes over a gradient, latitude by longitude, upper edge +y, left edge -z, middle +z.

const radians = (degrees) => (degrees * Math.PI) / 180;
const smoothstep = (x) => (x <= 0 ? 0 : x >= 1 ? 1 : x * x * (3 - 2 * x));

// Azimuth in degrees from -z over +x, elevation; half width and half height in degrees; radiance; soft edge.
const boxes = [
  { azimuth: 28, elevation: 38, width: 24, height: 17, radiance: [17, 16, 14.5], edge: 6 },   // key, behind
  { azimuth: 262, elevation: 42, width: 20, height: 24, radiance: [2.4, 2.6, 2.95], edge: 8 },  // fill, left
  { azimuth: 150, elevation: 58, width: 34, height: 7, radiance: [3, 2.95, 2.8], edge: 5 },   // strip, front
];

function studio(direction) {
  const [x, y, z] = direction;
  // From a dark ground over a light horizon to a dim ceiling.
  const sky = y < 0 ? 0.10 : 0.16 + 0.24 * Math.pow(1 - y, 3);
  const colour = [sky * 0.95, sky, sky * 1.08];
  for (const box of boxes) {
    const a = radians(box.azimuth), e = radians(box.elevation);
    const forward = [Math.sin(a) * Math.cos(e), Math.sin(e), -Math.cos(a) * Math.cos(e)];
    const right = [Math.cos(a), 0, Math.sin(a)];
    const up = [-Math.sin(a) * Math.sin(e), Math.cos(e), Math.cos(a) * Math.sin(e)];
    const dot = (v) => v[0] * x + v[1] * y + v[2] * z;
    if (dot(forward) <= 0) continue;
    // Distance from the edge of a rectangle in the plane that touches the sphere there.
    const inside = (axis, half) => Math.tan(radians(half)) - Math.abs(dot(axis) / dot(forward));
    const soft = Math.tan(radians(box.edge));
    const share = smoothstep(inside(right, box.width) / soft) * smoothstep(inside(up, box.height) / soft);
    for (let k = 0; k < 3; ++k) colour[k] += share * box.radiance[k];
  }
  return colour;
}

function rgbe([r, g, b]) {
  const largest = Math.max(r, g, b);
  if (largest < 1e-32) return [0, 0, 0, 0];
  let exponent = Math.floor(Math.log2(largest)) + 1;
  let scale = 256 / Math.pow(2, exponent);
  if (Math.round(largest * scale) > 255) { ++exponent; scale /= 2; }
  return [r, g, b].map((v) => Math.round(v * scale)).concat(exponent + 128);
}

// Radiance's run-length coding of one byte plane: a count above 128 repeats, one up to 128 copies.
function run_lengths(bytes) {
  const out = [];
  for (let i = 0; i < bytes.length; ) {
    let run = 1;
    while (run < 127 && i + run < bytes.length && bytes[i + run] === bytes[i]) ++run;
    if (run > 2) {
      out.push(128 + run, bytes[i]);
      i += run;
      continue;
    }
    const begin = i;
    const repeats = (at) =>
      at + 2 < bytes.length && bytes[at] === bytes[at + 1] && bytes[at] === bytes[at + 2];
    while (i < bytes.length && i - begin < 128 && !repeats(i)) ++i;
    out.push(i - begin, ...bytes.slice(begin, i));
  }
  return out;
}

function write_studio(width, height) {
  const out = [];
  for (let row = 0; row < height; ++row) {
    const texels = [];
    for (let column = 0; column < width; ++column) {
      const sum = [0, 0, 0], n = 4;  // the mean of n x n points
      for (let i = 0; i < n * n; ++i) {
        const theta = Math.PI * ((row + (Math.floor(i / n) + 0.5) / n) / height);
        const phi = 2 * Math.PI * ((column + ((i % n) + 0.5) / n) / width);
        const s = Math.sin(theta);
        const colour = studio([s * Math.sin(phi), Math.cos(theta), -s * Math.cos(phi)]);
        for (let k = 0; k < 3; ++k) sum[k] += colour[k] / (n * n);
      }
      texels.push(rgbe(sum));
    }
    out.push(2, 2, width >> 8, width & 255);
    for (let plane = 0; plane < 4; ++plane) out.push(...run_lengths(texels.map((t) => t[plane])));
  }
  const header =
    `#?RADIANCE\n# tools/make_scene_files.js\nFORMAT=32-bit_rle_rgbe\n\n-Y ${height} +X ${width}\n`;
  fs.writeFileSync(path.join(scenes, "studio.hdr"), Buffer.concat([Buffer.from(header), Buffer.from(out)]));
}

// ---- Turned shapes. A profile is a polyline of [radius, height, rounding, facets of the rounding] around the
// ---- y-axis, with the inside to its left; rounded corners and the lines between them have exact normals.

function points_of(profile) {
  const points = [];  // [r, y, normal r, normal y]
  const unit = (a, b) => {
    const d = [b[0] - a[0], b[1] - a[1]], length = Math.hypot(...d);
    return [d[0] / length, d[1] / length];
  };
  profile.forEach((corner, i) => {
    const before = i > 0 ? unit(profile[i - 1], corner) : null;
    const after = i + 1 < profile.length ? unit(corner, profile[i + 1]) : null;
    if (!before || !after) {
      const t = before || after;
      points.push([corner[0], corner[1], t[1], -t[0]]);
      return;
    }
    const turn = Math.atan2(before[0] * after[1] - before[1] * after[0],
                            before[0] * after[0] + before[1] * after[1]);
    const radius = corner[2], arc_steps = corner[3] || 8, side = Math.sign(turn);
    const reach = radius * Math.tan(Math.abs(turn) / 2);
    const start = [corner[0] - before[0] * reach, corner[1] - before[1] * reach];
    const centre = [start[0] - before[1] * radius * side, start[1] + before[0] * radius * side];
    for (let k = 0; k <= arc_steps; ++k) {
      const angle = (turn * k) / arc_steps, c = Math.cos(angle), s = Math.sin(angle);
      const t = [before[0] * c - before[1] * s, before[0] * s + before[1] * c], n = [t[1], -t[0]];
      points.push([centre[0] + n[0] * radius * side, centre[1] + n[1] * radius * side, n[0], n[1]]);
    }
  });
  return points;
}

function write_turned(name, what, points, segments = 96) {
  const fixed = (v) => String(Number(v.toFixed(4)) || 0);  // no -0
  const lines = [`# ${what}; by tools/make_scene_files.js`], rings = [];
  let count = 0;
  for (const [r, y, nr, ny] of points) {
    const ring = [];
    for (let j = 0; j < (r < 1e-9 ? 1 : segments); ++j) {
      const c = Math.cos((2 * Math.PI * j) / segments), s = Math.sin((2 * Math.PI * j) / segments);
      lines.push(`v ${fixed(r * c)} ${fixed(y)} ${fixed(r * s)}`);
      const normal = r < 1e-9 ? [0, Math.sign(ny), 0] : [nr * c, ny, nr * s];
      lines.push(`vn ${normal.map(fixed).join(" ")}`);
      ring.push(++count);
    }
    rings.push(ring);
  }
  const face = (...corners) => lines.push("f " + corners.map((v) => `${v}//${v}`).join(" "));
  for (let i = 0; i + 1 < rings.length; ++i) {
    const a = rings[i], b = rings[i + 1];
    for (let j = 0; j < segments; ++j) {
      const k = (j + 1) % segments;
      if (a.length === 1) face(a[0], b[j], b[k]);
      else if (b.length === 1) face(a[j], b[0], a[k]);
      else face(a[j], b[j], b[k], a[k]);
    }
  }
  fs.writeFileSync(path.join(scenes, "shapes", name), lines.join("\n") + "\n");
}

// A tumbler, its wall 1.6 mm thick. The milk reaches into the wall, as milk wets glass: there is no air between
// them, and the glass's inner face ends just below the surface of the milk.
const tumbler = { foot: 15, rim: 18, height: 44, wall: 1.6, level: 34, bottom: 1.8 };
const outer = (y) => tumbler.foot + ((tumbler.rim - tumbler.foot) * y) / tumbler.height;
const wetted = (y) => outer(y) - tumbler.wall + 0.5;
const ends_at = tumbler.level - 0.6;

write_studio(256, 128);
fs.mkdirSync(path.join(scenes, "shapes"), { recursive: true });
write_turned("tumbler.obj", "Clear glass: outside, rim and the inside down to the milk, mm",
  points_of([[0, 0.2], [outer(0), 0.2, 0.4, 6], [outer(tumbler.height), tumbler.height, 0.7],
             [outer(tumbler.height) - tumbler.wall, tumbler.height, 0.7],
             [outer(ends_at) - tumbler.wall, ends_at]]));
write_turned("milk.obj", "What fills tumbler.obj, closed, mm",
  points_of([[0, tumbler.bottom], [wetted(tumbler.bottom), tumbler.bottom, 1],
             [wetted(tumbler.level), tumbler.level, 0.3], [0, tumbler.level]]));
write_turned("candle.obj", "A candle with a dip at its top, closed, mm",
  points_of([[0, 0], [20, 0, 0.8, 6], [20, 62, 2.6, 20], [15.2, 61.5, 2.2, 10], [11, 54.5, 6],
             [0, 53.5]]), 72);
// A flame: a drop with its tip up.
const flame = [];
for (let k = 0; k <= 24; ++k) {
  const t = (Math.PI * k) / 24;
  const at = (u) => [2.7 * Math.sin(u) * Math.pow(Math.cos(u / 2), 1.2), 7.5 * (1 - Math.cos(u))];
  const [r, y] = at(t), [r1, y1] = at(Math.min(t + 1e-4, Math.PI)), [r0, y0] = at(Math.max(t - 1e-4, 0));
  const length = Math.hypot(r1 - r0, y1 - y0) || 1;
  flame.push([k === 0 || k === 24 ? 0 : r, y, (y1 - y0) / length, -(r1 - r0) / length]);
}
write_turned("flame.obj", "A flame, mm", flame, 48);

// The wedge: steps of 1, 2, ... mm, flat at the back, each 14 mm wide and 46 mm high.
function write_wedge(steps, width, height) {
  const lines = [`# A step wedge, 1 to ${steps} mm thick, closed, mm; by tools/make_scene_files.js`];
  const outline = [[0, 0]];
  for (let i = 1; i <= steps; ++i) outline.push([(i - 1) * width, i], [i * width, i]);
  outline.push([steps * width, 0]);
  // Points where steps begin, on the back, so that no edge ends in the middle of another.
  for (let i = steps - 1; i > 0; --i) outline.push([i * width, 0]);
  for (const y of [0, height])
    for (const [x, z] of outline) lines.push(`v ${x - (steps * width) / 2} ${y} ${z}`);
  const n = outline.length;
  for (let i = 0; i < n; ++i) {
    const k = (i + 1) % n;
    lines.push(`f ${i + 1} ${k + 1} ${k + 1 + n} ${i + 1 + n}`);
  }
  // Both ends, step by step: a column's corners are back left, front left, front right, back right.
  for (let i = 1; i <= steps; ++i) {
    // The back's vertex where step `at` ends.
    const back = (at) => (at === 0 ? 1 : at === steps ? 2 * steps + 2 : 3 * steps + 2 - at);
    const column = [back(i - 1)];
    if (i > 1) column.push(2 * i - 1);  // where the step before ends
    column.push(2 * i, 2 * i + 1, back(i));
    lines.push("f " + column.slice().reverse().join(" "), "f " + column.map((v) => v + n).join(" "));
  }
  fs.writeFileSync(path.join(scenes, "shapes", "step_wedge.obj"), lines.join("\n") + "\n");
}
write_wedge(6, 14, 46);
