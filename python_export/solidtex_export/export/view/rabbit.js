// A rabbit: bones with flesh around them, whose surface is found on a grid (surface nets, Gibson
// 1998: a vertex in every cell that the surface crosses, at the mean of the crossed edges).

// Ends and the radii there; those beside the middle are mirrored.
const BONES = [
  [[-0.36, -0.36, 0], 0.40, [0.12, -0.12, 0], 0.32],      // body
  [[0.12, -0.12, 0], 0.28, [0.40, 0.26, 0], 0.19],        // neck
  [[0.42, 0.32, 0], 0.23, [0.64, 0.22, 0], 0.13],         // head
  [[-0.76, -0.32, 0], 0.14, [-0.76, -0.32, 0], 0.14],     // tail
  ...[-1, 1].flatMap((side) => [
    [[0.38, 0.48, side * 0.10], 0.06, [0.22, 0.84, side * 0.17], 0.10],   // ear
    [[0.22, 0.84, side * 0.17], 0.10, [0.08, 1.12, side * 0.21], 0.05],
    [[-0.32, -0.46, side * 0.26], 0.24, [-0.08, -0.60, side * 0.30], 0.15],  // haunch
    [[-0.26, -0.74, side * 0.30], 0.10, [0.14, -0.76, side * 0.30], 0.08],   // foot
    [[0.26, -0.28, side * 0.15], 0.13, [0.36, -0.72, side * 0.15], 0.08],    // leg
    [[0.36, -0.75, side * 0.15], 0.09, [0.50, -0.77, side * 0.15], 0.07],    // paw
  ]),
];
const SOFTNESS = 0.05;

// Roughly the distance from the surface, negative inside: a soft minimum over bones.
function fleshAt(p) {
  let sum = 0;
  for (const [a, from, b, to] of BONES) {
    const along = minus(b, a), ray = minus(p, a);
    const t = Math.min(1, Math.max(0, dot(ray, along) / (dot(along, along) || 1)));
    const distance = Math.hypot(...minus(ray, along.map((c) => t * c))) - from - t * (to - from);
    sum += Math.exp(-distance / SOFTNESS);
  }
  return -SOFTNESS * Math.log(sum);
}

// The surface where `field` is 0, in a box from `low` with `count` cells of one edge.
function surfaceNet(field, low, count, edge) {
  const at = (cell) => cell.map((c, axis) => low[axis] + edge * c);
  const index = ([i, j, k]) => (i * (count[1] + 1) + j) * (count[2] + 1) + k;
  const values = new Float32Array((count[0] + 1) * (count[1] + 1) * (count[2] + 1));
  const each = (visit) => {
    for (let i = 0; i <= count[0]; ++i)
      for (let j = 0; j <= count[1]; ++j)
        for (let k = 0; k <= count[2]; ++k) visit([i, j, k]);
  };
  each((corner) => { values[index(corner)] = field(at(corner)); });
  const vertex = (cell) => {
    const sum = [0, 0, 0, 0];
    for (let axis = 0; axis < 3; ++axis)
      for (const [u, v] of [[0, 0], [0, 1], [1, 0], [1, 1]]) {
        const a = cell.slice(), b = cell.slice();
        a[(axis + 1) % 3] += u;
        a[(axis + 2) % 3] += v;
        b[(axis + 1) % 3] += u;
        b[(axis + 2) % 3] += v;
        b[axis] += 1;
        const [from, to] = [values[index(a)], values[index(b)]];
        if (from < 0 === to < 0) continue;
        a[axis] += from / (from - to);
        [...at(a), 1].forEach((c, i) => { sum[i] += c; });
      }
    return [0, 1, 2].map((i) => sum[i] / sum[3]);
  };
  const positions = [], normals = [], step = edge / 4;
  const add = (p) => {
    positions.push(...p);
    const slope = (axis) => {
      const [a, b] = [p.slice(), p.slice()];
      a[axis] += step;
      b[axis] -= step;
      return field(a) - field(b);
    };
    normals.push(...unit([slope(0), slope(1), slope(2)]));
  };
  each((corner) => {
    for (let axis = 0; axis < 3; ++axis) {
      const next = corner.slice();
      next[axis] += 1;
      if (next[axis] > count[axis]) continue;
      const isInside = values[index(corner)] < 0;
      if (isInside === values[index(next)] < 0) continue;
      const quad = [[0, 0], [1, 0], [1, 1], [0, 1]].map(([u, v]) => {
        const cell = corner.slice();
        cell[(axis + 1) % 3] -= u;
        cell[(axis + 2) % 3] -= v;
        return vertex(cell);
      });
      if (!isInside) quad.reverse();
      for (const i of [0, 1, 2, 0, 2, 3]) add(quad[i]);
    }
  });
  return { positions: new Float32Array(positions), normals: new Float32Array(normals) };
}

function rabbit() {
  const fail = (what) => { throw new Error(`rabbit: ${what}`); };
  return fitted(surfaceNet(fleshAt, [-1, -0.95, -0.66], [48, 54, 33], 0.04), fail);
}
SHAPES.rabbit = rabbit;
