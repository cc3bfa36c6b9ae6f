// Triangle meshes: three positions and three normals a triangle. The longest side is from -1 to 1.

function cube() {
  const positions = [], normals = [];
  for (let axis = 0; axis < 3; ++axis)
    for (const side of [-1, 1]) {
      const corner = (u, v) => {
        const at = [0, 0, 0];
        at[axis] = side;
        at[(axis + 1) % 3] = side * u;
        at[(axis + 2) % 3] = v;
        return at;
      };
      const normal = [0, 0, 0];
      normal[axis] = side;
      for (const [u, v] of [[-1, -1], [1, -1], [1, 1], [-1, -1], [1, 1], [-1, 1]]) {
        positions.push(...corner(u, v));
        normals.push(...normal);
      }
    }
  return { positions: new Float32Array(positions), normals: new Float32Array(normals) };
}

// A surface of points at(u, v) with u and v from 0 to 1.
function surface(at, columns, rows) {
  const positions = [], normals = [], step = 1e-3;
  const vertex = (u, v) => {
    const p = at(u, v), a = minus(at(u + step, v), at(u - step, v));
    const b = minus(at(u, v + step), at(u, v - step));
    positions.push(...p);
    normals.push(...unit(cross(a, b)));
  };
  for (let i = 0; i < columns; ++i)
    for (let j = 0; j < rows; ++j)
      for (const [k, l] of [[0, 0], [1, 0], [1, 1], [0, 0], [1, 1], [0, 1]])
        vertex((i + k) / columns, (j + l) / rows);
  return { positions: new Float32Array(positions), normals: new Float32Array(normals) };
}

function sphere() {
  const at = (u, v) => {
    const a = 2 * Math.PI * u, b = Math.PI * (0.998 * v + 0.001 - 0.5);
    return [Math.cos(a) * Math.cos(b), -Math.sin(a) * Math.cos(b), -Math.sin(b)];
  };
  const mesh = surface(at, 96, 48);
  mesh.normals = mesh.positions.slice();
  return mesh;
}

function knot() {
  const along = (u) => {
    const a = 4 * Math.PI * u, b = 6 * Math.PI * u, r = 0.5 + 0.22 * Math.cos(b);
    return [r * Math.cos(a), r * Math.sin(a), 0.3 * Math.sin(b)];
  };
  return surface((u, v) => {
    const tangent = unit(minus(along(u + 1e-3), along(u - 1e-3)));
    const across = unit(cross(tangent, [0, 0, 1])), up = cross(across, tangent);
    const a = 2 * Math.PI * v, p = along(u);
    return p.map((c, i) => c + 0.17 * (Math.cos(a) * across[i] + Math.sin(a) * up[i]));
  }, 240, 24);
}

const SHAPES = { cube, sphere, knot };

// Extensions that change no shape.
const ABOUT_SURFACES = /^(KHR|EXT)_(materials|texture|lights|xmp)/;
// Modes of primitives with triangles, and the corners of the i-th one.
const TRIANGLES = { 4: (i) => [3 * i, 3 * i + 1, 3 * i + 2],
                    5: (i) => [i, i + 1 + i % 2, i + 2 - i % 2],
                    6: (i) => [0, i + 1, i + 2] };

// Reads a .glb file. Throws an Error whose message is for the user.
function readGlb(buffer, name) {
  const view = new DataView(buffer);
  const fail = (what) => { throw new Error(`${name}: ${what}`); };
  if (buffer.byteLength < 20 || view.getUint32(0, true) !== 0x46546c67)
    fail("found no binary glTF, expected a .glb file");
  const size = view.getUint32(12, true);
  let document;
  try {
    document = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 20, size)));
  } catch {
    fail("found a damaged JSON part, expected that of a .glb file");
  }
  const extension = (document.extensionsRequired ?? []).find((e) => !ABOUT_SURFACES.test(e));
  if (extension) fail(`needs the extension ${extension}; export it without compression`);
  const start = 28 + size;
  const item = (list, index) => document[list]?.[index]
    ?? fail(`found no ${list}[${index}], expected it in the JSON part of the file`);
  const read = (index, type) => {
    const accessor = item("accessors", index);
    const { bufferView } = accessor;
    const part = bufferView === undefined ? null : item("bufferViews", bufferView);
    const Kind = { 5121: Uint8Array, 5123: Uint16Array, 5125: Uint32Array, 5126: Float32Array }[
      accessor.componentType];
    if (!Kind || !part) fail("found vertices of an unknown kind, expected floats");
    if (part.buffer !== 0 || item("buffers", 0).uri !== undefined)
      fail("found vertices outside of its binary part, expected one .glb file without others");
    if (accessor.type !== type) fail(`found vertices as ${accessor.type}, expected ${type}`);
    const width = type === "VEC3" ? 3 : 1, bytes = Kind.BYTES_PER_ELEMENT;
    const pitch = part.byteStride ?? width * bytes;
    const first = start + (part.byteOffset ?? 0) + (accessor.byteOffset ?? 0);
    if (first + (accessor.count - 1) * pitch + width * bytes > buffer.byteLength)
      fail("found a file that ends before its vertices, expected a whole .glb file");
    const values = new Kind(width * accessor.count);
    for (let i = 0; i < accessor.count; ++i)
      values.set(new Kind(buffer.slice(first + i * pitch, first + i * pitch + width * bytes)),
                 width * i);
    return values;
  };
  const positions = [], normals = [];
  const addPrimitive = (primitive, matrix) => {
    const mode = primitive.mode ?? 4, corners = TRIANGLES[mode];
    if (!corners) return;
    const { POSITION, NORMAL: given } = primitive.attributes;
    if (POSITION === undefined) fail("found triangles without POSITION, expected their vertices");
    const from = read(POSITION, "VEC3");
    const facing = given === undefined ? null : read(given, "VEC3");
    const order = primitive.indices === undefined ? null : read(primitive.indices, "SCALAR");
    const count = order ? order.length : from.length / 3;
    const { turned, isMirrored } = matrixOfNormals(matrix);
    for (let i = 0; i < (mode === 4 ? Math.floor(count / 3) : count - 2); ++i) {
      const starts = corners(i).map((k) => 3 * (order ? order[k] : k));
      if (isMirrored) starts.reverse();
      if (Math.max(...starts) >= from.length)
        fail(`found the vertex ${Math.max(...starts) / 3}, expected one of ${from.length / 3}`);
      const placed = starts.map((c) => transformed(matrix, from.subarray(c, c + 3), 1));
      const flat = cross(minus(placed[1], placed[0]), minus(placed[2], placed[0]));
      starts.forEach((c, k) => {
        positions.push(...placed[k]);
        const n = facing ? transformed(turned, facing.subarray(c, c + 3), 0) : flat;
        const square = dot(n, n);
        normals.push(...unit(square > 0 && square < Infinity ? n : flat));
      });
    }
  };
  const seen = new Set();
  const addNode = (index, parent) => {
    if (seen.has(index)) fail(`found the node ${index} in two places, expected a tree of nodes`);
    seen.add(index);
    const node = item("nodes", index);
    const matrix = product(parent, node.matrix ?? matrixOf(node));
    if (node.mesh !== undefined)
      for (const p of item("meshes", node.mesh).primitives) addPrimitive(p, matrix);
    for (const child of node.children ?? []) addNode(child, matrix);
  };
  const scene = item("scenes", document.scene ?? 0);
  for (const node of scene.nodes ?? []) addNode(node, IDENTITY);
  if (positions.length === 0) fail("found no triangles, expected a mesh");
  return fitted(
    { positions: new Float32Array(positions), normals: new Float32Array(normals) }, fail);
}

function fitted(mesh, fail) {
  const low = [Infinity, Infinity, Infinity], high = low.map((v) => -v);
  mesh.positions.forEach((v, i) => {
    low[i % 3] = Math.min(low[i % 3], v);
    high[i % 3] = Math.max(high[i % 3], v);
  });
  const half = Math.max(...minus(high, low)) / 2;
  if (!(half > 0 && half < Infinity) || mesh.positions.some(Number.isNaN))
    fail("found points at one place, or not finite, expected a surface");
  mesh.positions = mesh.positions.map((v, i) => (v - (low[i % 3] + high[i % 3]) / 2) / half);
  return mesh;
}

// Vectors and matrices of four columns.

const IDENTITY = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];
function minus(a, b) { return [a[0] - b[0], a[1] - b[1], a[2] - b[2]]; }
function dot(a, b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
function cross(a, b) {
  return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
}
function unit(a) {
  const length = Math.sqrt(dot(a, a)) || 1;
  return [a[0] / length, a[1] / length, a[2] / length];
}
function product(a, b) {
  const result = [];
  for (let column = 0; column < 4; ++column)
    for (let row = 0; row < 4; ++row) {
      let sum = 0;
      for (let k = 0; k < 4; ++k) sum += a[4 * k + row] * b[4 * column + k];
      result.push(sum);
    }
  return result;
}
function transformed(m, p, w) {
  return [0, 1, 2].map((r) => m[r] * p[0] + m[4 + r] * p[1] + m[8 + r] * p[2] + w * m[12 + r]);
}
// Cofactors turn normals, also where lengths change unequally.
function matrixOfNormals(m) {
  const [a, b, c] = [0, 4, 8].map((first) => m.slice(first, first + 3));
  const isMirrored = dot(cross(a, b), c) < 0, side = isMirrored ? -1 : 1;
  const columns = [cross(b, c), cross(c, a), cross(a, b)];
  return { isMirrored,
           turned: [...columns.flatMap((column) => [...column.map((v) => side * v), 0]), 0, 0, 0, 1] };
}
function matrixOf({ translation: t = [0, 0, 0], rotation: q = [0, 0, 0, 1], scale: s = [1, 1, 1] }) {
  const [x, y, z, w] = q;
  return [
    s[0] * (1 - 2 * (y * y + z * z)), s[0] * 2 * (x * y + z * w), s[0] * 2 * (x * z - y * w), 0,
    s[1] * 2 * (x * y - z * w), s[1] * (1 - 2 * (x * x + z * z)), s[1] * 2 * (y * z + x * w), 0,
    s[2] * 2 * (x * z + y * w), s[2] * 2 * (y * z - x * w), s[2] * (1 - 2 * (x * x + y * y)), 0,
    ...t, 1,
  ];
}
// Camera at `eye` that looks at `target`; depth from `near` to 1 in clip space. `shift` moves the
// picture to the right, in half widths.
function cameraMatrix(eye, target, fieldOfView, aspect, near, shift) {
  const back = unit(minus(eye, target));
  const up = Math.abs(back[1]) > 0.999 ? [0, 0, 1] : [0, 1, 0];
  const right = unit(cross(up, back)), above = cross(back, right);
  const turn = [right[0], above[0], back[0], 0, right[1], above[1], back[1], 0,
    right[2], above[2], back[2], 0, -dot(right, eye), -dot(above, eye), -dot(back, eye), 1];
  const f = 1 / Math.tan(fieldOfView / 2), first = 0.01, last = 100;
  const a = (near * first - last) / (last - first);
  const b = (near - 1) * first * last / (last - first);
  return product([f / aspect, 0, 0, 0, 0, f, 0, 0, -shift, 0, a, -1, 0, 0, b, 0], turn);
}
