// Draws the mesh of the page in three dimensions, and measures its worst cells again.
//
// The page holds `meta` (sizes, families, places) and `packed` (arrays; src/report/page/coding.rs says how).
// When the mesh has been drawn, the body's data-state is "ready", and data-pixels is the number of pixels drawn.
"use strict";
(async () => {
const find = id => document.getElementById(id), body = document.body;
const meta = JSON.parse(find("meta").textContent);
const say = (text, bad) => { const to = find("message"); to.textContent = text; to.className = bad ? "error" : "note"; };

// --- Quality of the worst cells, from positions with all digits ---

const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const CORNERS = { // The corner first, then its three neighbours.
  4: [[0, 1, 2, 3], [1, 0, 3, 2], [2, 3, 0, 1], [3, 2, 1, 0]],
  5: [[0, 1, 3, 4], [1, 2, 0, 4], [2, 3, 1, 4], [3, 0, 2, 4]],
  6: [[0, 1, 2, 3], [1, 2, 0, 4], [2, 0, 1, 5], [3, 5, 4, 0], [4, 3, 5, 1], [5, 4, 3, 2]],
  8: [[0, 1, 3, 4], [1, 2, 0, 5], [2, 3, 1, 6], [3, 0, 2, 7], [4, 7, 5, 0], [5, 4, 6, 1], [6, 5, 7, 2], [7, 6, 4, 3]],
};
const FACES = {
  4: [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]],
  5: [[0, 3, 2, 1], [0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]],
  6: [[0, 2, 1], [3, 4, 5], [0, 1, 4, 3], [1, 2, 5, 4], [2, 0, 3, 5]],
  8: [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]],
};
function beta(points) {
  let longest = 0;
  for (let i = 0; i < 4; i++) for (let j = 0; j < i; j++) {
    const edge = minus(points[i], points[j]);
    longest = Math.max(longest, dot(edge, edge));
  }
  const [b, c, d] = [1, 2, 3].map(i => minus(points[i], points[0]));
  return dot(cross(b, c), d) / 6 / longest ** 1.5;
}
function jacobian(points) {
  return Math.min(...CORNERS[points.length].map(([at, ...others]) => {
    const [u, v, w] = others.map(other => minus(points[other], points[at]));
    return dot(cross(u, v), w) / Math.sqrt(dot(u, u) * dot(v, v) * dot(w, w));
  }));
}
const isSame = points => points.some((p, i) => points.some((q, j) => j < i && dot(minus(p, q), minus(p, q)) === 0));
const rows = [...document.querySelectorAll("#worst tr[data-cell]")];
let checked = 0, wrong = 0;
meta.worst.forEach((cell, number) => {
  // Of a cell that names a vertex twice, other corners count.
  if (cell.value === null || isSame(cell.points)) return;
  const found = (meta.measure === "beta" ? beta : jacobian)(cell.points);
  checked++;
  if (!(Math.abs(found - cell.value) <= 1e-6 * Math.abs(cell.value) + 1e-13)) {
    wrong++;
    rows[number]?.classList.add("wrong");
    find("measured").textContent = `Error: measured again, cell ${number + 1} has ${meta.measure} ${found}, and the report says ${cell.value}.`;
    find("measured").className = "error";
  }
});
Object.assign(body.dataset, { checked, wrong });
if (checked && !wrong) find("measured").textContent = `This page has measured ${checked} of these cells again, and found the same figures.`;

// --- Arrays ---

async function unpack() {
  const text = atob(find("packed").textContent.trim()), bytes = Uint8Array.from(text, letter => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}
if (!("DecompressionStream" in window)) throw new Error("this browser is too old to unpack the mesh");
const bytes = await unpack();
let offset = 0;
function numbers(count, width) {
  const whole = new Uint8Array(count * width);
  for (let k = 0; k < width; k++) for (let i = 0; i < count; i++) whole[i * width + k] = bytes[offset + k * count + i];
  offset += count * width;
  return whole.buffer;
}
function polygons(count, size) {
  const codes = new Uint32Array(numbers(count * size, 4)), all = new Uint32Array(count * size);
  const signed = code => code & 1 ? -(code >>> 1) - 1 : code >>> 1;
  for (let i = 0; i < count; i++) {
    let vertex = i ? all[(i - 1) * size] : 0;
    for (let k = 0; k < size; k++) all[i * size + k] = vertex += signed(codes[k * count + i]);
  }
  return { count, size, all };
}
const middle = [0, 1, 2].map(i => (meta.low[i] + meta.high[i]) / 2 - meta.centre[i]);
const n = meta.vertices;
const old = [0, 1, 2].map(() => new Float32Array(numbers(n, 4)));
const by = [0, 1, 2].map(() => new Int16Array(numbers(n, 2)));
const families = meta.families.map(of => ({ ...of, faces: [polygons(of.triangles, 3), polygons(of.quadrilaterals, 4)] }));
const cells = [4, 5, 6, 8].map((size, kind) => polygons(meta.cells[kind], size));
const quality = new Int8Array(numbers(meta.cells.reduce((a, b) => a + b), 1));
const far = meta.far ? Array.from(new Uint8Array(numbers(n, 1)), shade => shade / 255) : [];

const moved = v => [0, 1, 2].map(i => old[i][v] + by[i][v] * meta.unit);
const lengths = new Float32Array(n), lowest = new Int8Array(n).fill(127), hasCell = new Uint8Array(n);
for (let i = 0; i < n; i++) lengths[i] = Math.hypot(by[0][i], by[1][i], by[2][i]) / 32767;
const order = []; // [quality, kind, number in the kind]
{
  let cell = 0;
  cells.forEach((of, kind) => {
    for (let i = 0; i < of.count; i++, cell++) {
      const value = quality[cell];
      order.push([value, kind, i]);
      for (let k = 0; k < of.size; k++) {
        const vertex = of.all[i * of.size + k];
        hasCell[vertex] = 1;
        if (value < lowest[vertex]) lowest[vertex] = value;
      }
    }
  });
}
// Of two results the worst vertices are marked, not the worst cells.
const worst = meta.far ? [] : [...order].sort((a, b) => a[0] - b[0]).slice(0, 1000);

// --- Drawing ---

const canvas = find("canvas");
const gl = canvas.getContext("webgl2", { antialias: true, preserveDrawingBuffer: true });
if (!gl) {
  canvas.hidden = true;
  body.dataset.state = "no-webgl";
  return say("This browser has no WebGL 2, so the mesh cannot be drawn. The tables and charts of this page have its figures.");
}
const RAMPS = { // From low to high.
  displacement: [[.85, .88, .92], [.62, .78, .88], [.33, .65, .80], [.16, .47, .70], [.19, .27, .56], [.25, .09, .38]],
  quality: [[.70, .09, .13], [.91, .40, .22], [.97, .72, .40], [.93, .90, .70], [.64, .80, .78], [.36, .60, .72]],
};
RAMPS.distance = RAMPS.displacement;
const NONE = -9, INVERTED = -5, MARKED = -7;
const shader = (type, text) => {
  const made = gl.createShader(type);
  gl.shaderSource(made, "#version 300 es\nprecision highp float;" + text);
  gl.compileShader(made);
  if (!gl.getShaderParameter(made, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(made));
  return made;
};
const program = gl.createProgram();
gl.attachShader(program, shader(gl.VERTEX_SHADER, `
in vec3 from, way; in float value; in vec3 side;
uniform mat4 view; uniform float time, spot;
out vec3 place, sides; out float shade;
void main() { place = from + time * way; sides = side; shade = value; gl_Position = view * vec4(place, 1.); gl_PointSize = spot; }`));
gl.attachShader(program, shader(gl.FRAGMENT_SHADER, `
in vec3 place, sides; in float shade;
uniform vec3 eye, ramp[6], ink; uniform float edges, spot;
out vec4 colour;
vec3 ramped(float x) { x = clamp(x, 0., 1.) * 5.; int i = min(int(x), 4); return mix(ramp[i], ramp[i + 1], x - float(i)); }
void main() {
  float off = spot > 0. ? distance(gl_PointCoord, vec2(.5)) : 0.;
  if (off > .5) discard;
  vec3 normal = cross(dFdx(place), dFdy(place)), ray = normalize(eye - place);
  float light = spot > 0. ? 1. : .66 + .34 * abs(dot(normal, ray)) / length(normal);
  vec3 own = shade < -8. ? vec3(.74, .76, .79) : shade < -6. ? vec3(1., .75, 0.) : shade < -4. ? vec3(.85, 0., .75) : ramped(shade);
  vec3 pixel = max(fwidth(sides), vec3(1e-9)), near = sides / pixel;
  // Edges closer than some pixels would hide the colours.
  float room = 1. - smoothstep(.06, .3, max(pixel.x, max(pixel.y, pixel.z)));
  float line = edges * mix(.25, 1., room) * (1. - smoothstep(.3, 1.2, min(near.x, min(near.y, near.z))));
  colour = vec4(mix(own * light, ink, spot > 0. ? step(.36, off) : line), 1.);
}`));
gl.linkProgram(program);
gl.useProgram(program);
gl.enable(gl.DEPTH_TEST);
const at = name => gl.getUniformLocation(program, name);

/** Triangles for the device, each with corners of its own: old place, displacement, shade, distances from drawn edges. */
class Batch {
  constructor() { this.array = gl.createVertexArray(); this.buffer = gl.createBuffer(); this.corners = 0; }
  fill(list) {
    gl.bindVertexArray(this.array);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(list), gl.DYNAMIC_DRAW);
    [["from", 3, 0], ["way", 3, 12], ["value", 1, 24], ["side", 3, 28]].forEach(([name, size, start]) => {
      const place = gl.getAttribLocation(program, name);
      gl.enableVertexAttribArray(place);
      gl.vertexAttribPointer(place, size, gl.FLOAT, false, 40, start);
    });
    this.corners = list.length / 10;
  }
  draw(as = gl.TRIANGLES) { gl.bindVertexArray(this.array); gl.drawArrays(as, 0, this.corners); }
}
// Corners of the triangles of a face, and how far each is from the three edges of its triangle. The diagonal of a
// quadrilateral is no edge: nothing is near it.
const SIDES = {
  3: [[0, [1, 0, 0]], [1, [0, 1, 0]], [2, [0, 0, 1]]],
  4: [[0, [1, 1, 0]], [1, [0, 1, 0]], [2, [0, 1, 1]], [0, [1, 0, 1]], [2, [0, 1, 1]], [3, [0, 0, 1]]],
};
/** Adds a face of vertices in order. */
function face(list, vertices, shades) {
  for (const [k, sides] of SIDES[vertices.length]) {
    const v = vertices[k];
    list.push(old[0][v], old[1][v], old[2][v], by[0][v] * meta.unit, by[1][v] * meta.unit, by[2][v] * meta.unit, shades[k], ...sides);
  }
}
const colours = () => find("colours").value;
/** What each vertex has, if the colours show such a thing. */
const ofVertices = () => ({ displacement: lengths, distance: far })[colours()];
const shadeOf = value => value <= 0 ? INVERTED : value / 127;
/** The shades of a face of the surface: those of its vertices, unless one of them has a colour of its own. */
function shades(vertices) {
  const values = ofVertices();
  if (values) return vertices.map(v => values[v]);
  const own = vertices.map(v => colours() === "quality" && hasCell[v] ? shadeOf(lowest[v]) : NONE);
  const odd = [INVERTED, NONE].find(shade => own.includes(shade));
  return odd ? own.map(() => odd) : own;
}
function surface() {
  const list = [];
  families.filter(family => family.shown).forEach(family => family.faces.forEach(({ count, size, all }) => {
    for (let i = 0; i < count; i++) {
      const vertices = Array.from(all.subarray(i * size, (i + 1) * size));
      face(list, vertices, shades(vertices));
    }
  }));
  batches.surface.fill(list);
}
function cell(list, kind, number, value, marked) {
  const { size, all } = cells[kind], of = all.subarray(number * size, (number + 1) * size);
  const own = marked && value > 0 ? MARKED : shadeOf(value), values = marked ? null : ofVertices();
  FACES[size].forEach(places => {
    const vertices = places.map(k => of[k]);
    face(list, vertices, vertices.map(v => values ? values[v] : own));
  });
}
/** The direction across the slice: along an axis, or by two angles, from x towards y and from there up to z. */
function across() {
  const axis = find("axis").value;
  if (axis !== "any") return [0, 1, 2].map(i => +(i === +axis));
  const [round, up] = ["round", "up"].map(id => find(id).value * Math.PI / 180);
  return [Math.cos(up) * Math.cos(round), Math.cos(up) * Math.sin(round), Math.sin(up)];
}
function slice() {
  const list = [], axis = find("axis").value;
  let count = 0;
  find("place").disabled = axis === "";
  find("angles").hidden = axis !== "any";
  find("place-text").textContent = "";
  if (axis !== "") {
    const normal = across(), half = normal.reduce((sum, x, i) => sum + Math.abs(x) * (meta.high[i] - meta.low[i]) / 2, 0);
    const centre = dot(normal, meta.centre), stops = meta.stops?.[axis];
    let place = centre + dot(normal, middle) + 1.5 * half * (2 * find("place").value - 1);
    if (stops) place = stops.reduce((a, b) => Math.abs(b - place) < Math.abs(a - place) ? b : a);
    const name = axis === "any" ? `${find("round").value}\u00b0, ${find("up").value}\u00b0:` : `${"xyz"[axis]} =`;
    find("place-text").textContent = `${name} ${place.toPrecision(4)}`;
    const beyond = new Float32Array(n), isNear = new Uint8Array(n);
    for (let v = 0; v < n; v++) {
      const at = moved(v);
      beyond[v] = dot(normal, at) + centre - place;
      isNear[v] = Math.hypot(...minus(at, middle)) < .6 * meta.size;
    }
    order.forEach(([value, kind, number]) => {
      const { size, all } = cells[kind];
      let below = false, above = false, near = false;
      for (let k = 0; k < size; k++) {
        const v = all[number * size + k];
        if (beyond[v] <= 0) below = true;
        if (beyond[v] >= 0) above = true;
        if (isNear[v]) near = true;
      }
      // What is far from the moved families would hide them.
      if (below && above && near) { cell(list, kind, number, value, false); count++; }
    });
  }
  body.dataset.slice = count;
  batches.slice.fill(list);
}
/** Slices by a plane that faces the eye. */
function facingEye() {
  if (meta.stops) return;
  const [x, y, z] = directions()[2], degrees = angle => Math.round(angle * 180 / Math.PI);
  find("axis").value = "any";
  find("round").value = degrees(Math.atan2(y, x));
  find("up").value = degrees(Math.asin(z));
  slice();
}
function mark() {
  const list = [];
  worst.slice(0, +find("count").value || 0).forEach(([value, kind, number]) => cell(list, kind, number, value, true));
  batches.worst.fill(list);
}
const batches = {};
["surface", "slice", "worst", "chosen", "listed"].forEach(name => batches[name] = new Batch());
const middleOf = points => points.reduce((sum, p) => sum.map((x, i) => x + p[i] / points.length), [0, 0, 0]);
// The listed cells are too small to be seen from afar: each has a dot.
batches.listed.fill(meta.worst.flatMap(({ points, old: before }) => {
  const from = middleOf(before);
  return [...minus(from, meta.centre), ...minus(middleOf(points), from), MARKED, 1, 1, 1];
}));
function choose(number) {
  rows.forEach((row, other) => row.classList.toggle("chosen", other === number));
  const { points, old: before, size = 0 } = meta.worst[number], list = [];
  (FACES[points.length] ?? []).forEach(places => {
    for (let k = 1; k + 1 < places.length; k++) [places[0], places[k], places[k + 1]].forEach((v, i) => {
      list.push(...minus(before[v], meta.centre), ...minus(points[v], before[v]), MARKED, i === 0, i === 1, i === 2);
    });
  });
  batches.chosen.fill(list);
  const place = middleOf(points);
  const wide = Math.max(size, ...points.map(p => Math.hypot(...minus(p, place))));
  camera.centre = minus(place, meta.centre);
  camera.distance = Math.max(14 * wide, 1e-6 * meta.size);
  canvas.scrollIntoView({ block: "nearest" });
  later();
}

// --- Camera ---

const camera = {};
function home() {
  // A half model is seen from the side of its wing, not from that of its plane of symmetry.
  const side = meta.low[1] - meta.box[0] > meta.box[1] - meta.high[1] ? -1 : 1;
  Object.assign(camera, { turn: 2.2 * side, rise: .45, distance: 1.15 * meta.size, centre: middle });
  later();
}
/** The directions of the camera: to the right, up, and towards the eye. */
function directions() {
  const { turn, rise } = camera, back = [Math.cos(rise) * Math.cos(turn), Math.cos(rise) * Math.sin(turn), Math.sin(rise)];
  const right = [-Math.sin(turn), Math.cos(turn), 0];
  return [right, cross(back, right), back];
}
function pan(x, y) {
  const [right, up] = directions(), step = camera.distance / canvas.clientHeight;
  camera.centre = camera.centre.map((c, i) => c + step * (y * up[i] - x * right[i]));
}
function turn(x, y) {
  camera.turn -= x * .008;
  camera.rise = Math.min(1.55, Math.max(-1.55, camera.rise + y * .008));
}
const zoom = factor => { camera.distance = Math.min(60 * meta.size, Math.max(1e-7 * meta.size, camera.distance * factor)); };

let ink = [0, 0, 0];
function theme() {
  const [r, g, b] = getComputedStyle(body).getPropertyValue("--edge").trim().match(/\w\w/g).map(x => parseInt(x, 16) / 255);
  ink = [r, g, b];
}
function draw() {
  const scale = Math.min(2, window.devicePixelRatio || 1);
  const width = canvas.width = Math.round(canvas.clientWidth * scale), height = canvas.height = Math.round(canvas.clientHeight * scale);
  gl.viewport(0, 0, width, height);
  gl.clearColor(0, 0, 0, 0);
  gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  const [right, up, back] = directions(), eye = camera.centre.map((c, i) => c + camera.distance * back[i]);
  const focal = 2.2, near = camera.distance * .02, far = camera.distance + 60 * meta.size;
  const [a, b] = [(far + near) / (near - far), 2 * far * near / (near - far)];
  const view = new Float32Array(16);
  const fit = Math.min(1, width / height);
  [[right, focal * fit * height / width], [up, focal * fit]].forEach(([along, by], row) => {
    [0, 1, 2].forEach(i => view[4 * i + row] = by * along[i]);
    view[12 + row] = -by * dot(along, eye);
  });
  [0, 1, 2].forEach(i => { view[4 * i + 2] = a * back[i]; view[4 * i + 3] = -back[i]; });
  view[14] = -a * dot(back, eye) + b;
  view[15] = dot(back, eye);
  gl.uniformMatrix4fv(at("view"), false, view);
  gl.uniform1f(at("time"), +find("time").value);
  gl.uniform3fv(at("eye"), eye);
  gl.uniform3fv(at("ink"), ink);
  gl.uniform3fv(at("ramp"), (RAMPS[colours()] ?? RAMPS.quality).flat());
  gl.uniform1f(at("spot"), 0);
  gl.uniform1f(at("edges"), find("edges").checked ? .45 : 0);
  batches.surface.draw();
  batches.slice.draw();
  gl.uniform1f(at("edges"), .9);
  // Marked cells are seen through what covers them.
  gl.clear(gl.DEPTH_BUFFER_BIT);
  batches.worst.draw();
  batches.chosen.draw();
  gl.uniform1f(at("spot"), 9 * scale);
  gl.disable(gl.DEPTH_TEST);
  if (+find("count").value) batches.listed.draw(gl.POINTS);
  gl.enable(gl.DEPTH_TEST);
}
let asked = 0;
function later() {
  asked ||= requestAnimationFrame(() => { asked = 0; draw(); });
}
function legend() {
  const kind = colours(), ramp = RAMPS[kind], paint = find("ramp").getContext("2d");
  find("scale").hidden = !ramp;
  if (!ramp) return;
  const gradient = paint.createLinearGradient(0, 0, 160, 0);
  ramp.forEach((rgb, i) => gradient.addColorStop(i / 5, `rgb(${rgb.map(x => 255 * x)})`));
  paint.fillStyle = gradient;
  paint.fillRect(0, 0, 160, 10);
  find("what").textContent = kind === "quality" ? meta.measure : kind;
  const values = { // Shades of quality go with its root, and those of distances with the logarithm.
    displacement: share => meta.largest * share,
    quality: share => meta.best * share ** 2,
    distance: share => meta.far.largest * 10 ** (meta.far.decades * (share - 1)),
  };
  find("ticks").replaceChildren(...[0, .5, 1].map(share => {
    const tick = document.createElement("span");
    tick.textContent = +values[kind](share).toPrecision(2);
    return tick;
  }));
}

// --- Controls ---

const all = () => { legend(); surface(); slice(); mark(); later(); };
find("colours").oninput = all;
["axis", "place", "round", "up"].forEach(id => find(id).oninput = () => { slice(); later(); });
find("facing").onclick = () => { facingEye(); later(); };
if (meta.far) {
  find("colours").add(new Option("distance"), 0);
  find("colours").value = "distance";
}
// A part of a large mesh has the cells of its own slices alone.
if (meta.stops) find("axis").querySelector("[value=any]").remove();
find("count").oninput = () => { mark(); later(); };
find("time").oninput = find("edges").oninput = later;
find("home").onclick = home;
find("controls").onsubmit = event => event.preventDefault();
families.forEach(family => {
  const label = document.createElement("label"), box = document.createElement("input");
  Object.assign(box, { type: "checkbox", checked: family.shown, oninput() { family.shown = box.checked; surface(); later(); } });
  label.append(box, family.name);
  find("families").append(label);
});
rows.forEach((row, number) => {
  row.onclick = () => choose(number);
  row.onkeydown = event => { if (event.key === "Enter" || event.key === " ") { event.preventDefault(); choose(number); } };
});
const held = new Map();
canvas.onpointerdown = event => { canvas.setPointerCapture(event.pointerId); held.set(event.pointerId, event); };
canvas.onpointerup = canvas.onpointercancel = event => held.delete(event.pointerId);
canvas.oncontextmenu = event => event.preventDefault();
canvas.onpointermove = event => {
  const before = held.get(event.pointerId);
  if (!before) return;
  const x = event.clientX - before.clientX, y = event.clientY - before.clientY;
  if (held.size === 2) {
    const other = [...held].find(([id]) => id !== event.pointerId)[1];
    const apart = from => Math.hypot(from.clientX - other.clientX, from.clientY - other.clientY);
    zoom(apart(before) / Math.max(1, apart(event)));
    pan(x / 2, y / 2);
  } else if (event.buttons !== 1 || event.shiftKey) pan(x, y);
  else turn(x, y);
  held.set(event.pointerId, event);
  later();
};
canvas.addEventListener("wheel", event => { event.preventDefault(); zoom(Math.exp(event.deltaY * .001)); later(); }, { passive: false });
canvas.onkeydown = event => {
  if (event.ctrlKey || event.altKey || event.metaKey) return;
  const step = { ArrowLeft: [-30, 0], ArrowRight: [30, 0], ArrowUp: [0, -30], ArrowDown: [0, 30] }[event.key];
  if (step) (event.shiftKey ? pan : turn)(...step);
  else if (event.key === "+" || event.key === "=") zoom(.8);
  else if (event.key === "-") zoom(1.25);
  else if (event.key === "0") home();
  else if (event.key === "p") facingEye();
  else if ("xyz".includes(event.key)) { find("axis").value = "xyz".indexOf(event.key); slice(); }
  else if (event.key === "[" || event.key === "]") { find("place").value = +find("place").value + (event.key === "[" ? -.01 : .01); slice(); }
  else return;
  event.preventDefault();
  later();
};
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { theme(); later(); });
new ResizeObserver(later).observe(canvas);

theme();
find("controls").hidden = false;
home();
all();
draw();
const pixels = new Uint8Array(canvas.width * canvas.height * 4);
gl.readPixels(0, 0, canvas.width, canvas.height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
let drawn = 0;
for (let i = 3; i < pixels.length; i += 4) if (pixels[i]) drawn++;
say("Drag to turn, with the right button or two fingers to move, scroll or pinch to zoom. Keys: arrows, shift and arrows, + and -, 0; x, y, z and p slice (p faces you), [ and ] move the slice.");
Object.assign(body.dataset, { pixels: drawn, milliseconds: Math.round(performance.now()), state: "ready" });
})().catch(error => {
  document.getElementById("message").textContent = `The mesh cannot be drawn: ${error.message}`;
  document.getElementById("message").className = "error";
  document.body.dataset.state = "error";
  document.body.dataset.error = error.message;
});
