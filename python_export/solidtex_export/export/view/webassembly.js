// The solid without graphics: the engine in WebAssembly evaluates points in workers, of which each
// draws some columns. The page carries the engine as ENGINE, or null.

const MAX_WORKERS = 8, NEAREST = 0.01, BACKGROUND = 219;

async function unpacked(text) {
  const packed = new Blob([bytesOf(text)]).stream();
  return new Response(packed.pipeThrough(new DecompressionStream("gzip"))).arrayBuffer();
}

// A worker with the engine, which engine_worker.js calls.
class EngineWorker {
  calls = new Map();
  count = 0;

  constructor(url, onLost) {
    this.worker = new Worker(url);
    this.worker.onmessage = ({ data: [id, result, problem] }) => {
      const [resolve, reject] = this.calls.get(id);
      this.calls.delete(id);
      if (problem === undefined) resolve(result);
      else reject(new Error(problem));
    };
    this.worker.onerror = ({ message }) => {
      for (const [, reject] of this.calls.values()) reject(new Error(message));
      onLost(`a worker failed: ${message}`);
    };
  }

  call(method, ...given) {
    return new Promise((resolve, reject) => {
      this.calls.set(this.count, [resolve, reject]);
      this.worker.postMessage([this.count++, method, given]);
    });
  }
}

// Vertices of a polygon of [clip x, y, w, position, normal] in front of the camera.
function inFront(polygon) {
  return polygon.flatMap((a, i) => {
    const b = polygon[(i + 1) % polygon.length], kept = a[2] >= NEAREST ? [a] : [];
    if ((a[2] >= NEAREST) === (b[2] >= NEAREST)) return kept;
    const t = (NEAREST - a[2]) / (b[2] - a[2]);
    return [...kept, a.map((v, k) => v + t * (b[k] - v))];
  });
}

// The numbers that settingsOf() packs for shaders.
function unpackedSettings(s) {
  const [isLit, isCut, isFiltered] = s.subarray(28);
  return { clip: s.subarray(0, 16), eye: Array.from(s.subarray(16, 19)), pixel: s[19],
           cutNormal: Array.from(s.subarray(20, 23)), cutAt: s[23], scale: s[27],
           isLit, isCut, isFiltered };
}

// What each pixel shows of a mesh: position and normal.
class Surface {
  constructor(width, height, mesh, settings) {
    Object.assign(this, { width, height, settings });
    this.nearness = new Float32Array(width * height);  // 1 / w, or 0: nothing
    this.points = new Float32Array(6 * width * height);
    const { positions, normals } = mesh, m = settings.clip;
    const corner = (i) => {
      const p = positions.subarray(i, i + 3), n = normals.subarray(i, i + 3);
      const clip = [0, 1, 3].map((r) => m[r] * p[0] + m[4 + r] * p[1] + m[8 + r] * p[2] + m[12 + r]);
      return [...clip, ...p, ...n];
    };
    for (let i = 0; i < positions.length; i += 9) {
      const polygon = inFront([corner(i), corner(i + 3), corner(i + 6)]);
      for (let k = 2; k < polygon.length; ++k)
        this.add([polygon[0], polygon[k - 1], polygon[k]]);
    }
  }

  add(triangle) {
    const { width, height } = this;
    const [a, b, c] = triangle.map(([x, y, w]) => [
      (x / w + 1) * width / 2 - 0.5, (1 - y / w) * height / 2 - 0.5]);
    const side = (p, q, x, y) => (q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0]);
    const area = side(a, b, ...c);
    if (area === 0) return;
    const first = (i, from) => Math.max(from, Math.ceil(Math.min(a[i], b[i], c[i])));
    const last = (i, to) => Math.min(to - 1, Math.floor(Math.max(a[i], b[i], c[i])));
    const right = last(0, width), bottom = last(1, height);
    for (let y = first(1, 0); y <= bottom; ++y)
      for (let x = first(0, 0); x <= right; ++x) {
        const shares = [side(b, c, x, y) / area, side(c, a, x, y) / area, side(a, b, x, y) / area];
        if (shares[0] >= 0 && shares[1] >= 0 && shares[2] >= 0)
          this.cover(y * width + x, triangle, shares, area < 0);
      }
  }

  // Rows go down, so a front's corners turn to the left where the area is negative.
  cover(pixel, [a, b, c], shares, isFront) {
    const [u, v, t] = [shares[0] / a[2], shares[1] / b[2], shares[2] / c[2]], nearness = u + v + t;
    if (nearness <= this.nearness[pixel]) return;
    const point = [3, 4, 5, 6, 7, 8].map((k) => (u * a[k] + v * b[k] + t * c[k]) / nearness);
    const { eye, cutNormal, cutAt, isCut } = this.settings;
    if (isCut) {
      const below = cutAt - dot(cutNormal, point), above = dot(cutNormal, eye) - cutAt;
      if (below < 0) return;
      if (!isFront && above > 0) {  // the ray enters where the solid is cut
        const along = above / (above + below);
        for (let i = 0; i < 3; ++i) {
          point[i] = eye[i] + along * (point[i] - eye[i]);
          point[3 + i] = cutNormal[i];
        }
      }
    }
    this.nearness[pixel] = nearness;
    this.points.set(point, 6 * pixel);
  }
}

class WebAssemblyView {
  static near = -1;  // of clip space
  // A processor computes fewer bricks in the same time: texels across at first and at most, and rows
  // of a part, which cannot be given up.
  static texels = 128;
  static mostTexels = 256;
  static firstRows = 2;
  static leastRows = 1;

  static async create(canvas, onLost) {
    const context = ENGINE && canvas.getContext("2d");
    if (!context) return null;
    const [worker, script, wasm] = await Promise.all(
      [ENGINE.worker, ENGINE.script, ENGINE.wasm].map(unpacked));
    const url = URL.createObjectURL(new Blob([worker], { type: "text/javascript" }));
    const count = Math.min(MAX_WORKERS, navigator.hardwareConcurrency || 1);
    const workers = Array.from({ length: count }, () => new EngineWorker(url, onLost));
    await Promise.all(workers.map((worker) => worker.call("start", script, wasm)));
    return new WebAssemblyView(context, workers);
  }

  constructor(context, workers) {
    Object.assign(this, { context, workers, name: "WebAssembly" });
  }

  setMesh(mesh) { this.mesh = mesh; }
  setPlace() {}
  async refine() { return false; }

  async setModel(model) {
    this.model = model;
    this.file = await unpacked(model.file);
  }

  setSeed(seed) {
    this.loaded = Promise.all(
      this.workers.map((worker) => worker.call("load", this.file, { precision: "fast", seed })));
    this.loaded.catch(() => {});  // draw() says what was wrong
  }

  begin(width, height) {
    this.surface = null;
    this.image = new ImageData(width, height);
    this.image.data.fill(BACKGROUND);
    for (let i = 3; i < this.image.data.length; i += 4) this.image.data[i] = 255;
  }

  async draw(packed, origin, [x, y, width, height]) {
    await this.loaded;
    const settings = unpackedSettings(packed);
    this.surface ??= new Surface(this.image.width, this.image.height, this.mesh, settings);
    const { workers, surface } = this, edge = (i) => x + Math.round(i * width / workers.length);
    await Promise.all(workers.map(async (worker, i) => {
      const pixels = [];
      for (let row = y; row < y + height; ++row)
        for (let column = edge(i); column < edge(i + 1); ++column) {
          const pixel = row * surface.width + column;
          if (surface.nearness[pixel] > 0) pixels.push(pixel);
        }
      if (pixels.length > 0) await this.shade(worker, pixels, settings, origin);
    }));
  }

  async shade(worker, pixels, { eye, pixel: ofPixel, scale, isLit, isFiltered }, origin) {
    const positions = new Float32Array(3 * pixels.length), radii = new Float32Array(pixels.length);
    const facing = pixels.map((pixel, i) => {
      const point = this.surface.points.subarray(6 * pixel, 6 * pixel + 6);
      const ray = minus(eye, point), normal = unit(point.subarray(3));
      for (let axis = 0; axis < 3; ++axis) positions[3 * i + axis] = scale * point[axis];
      radii[i] = 0.5 * scale * Math.hypot(...ray) * ofPixel;
      return dot(normal, ray) < 0 ? normal.map((v) => -v) : normal;
    });
    const values = await worker.call("evalPoints", positions,
      { origin: Array.from(origin), ...(isFiltered && { radii }) });
    const { color } = this.model, channels = values.length / pixels.length;
    const sun = unit([1, 2, 3]), { data } = this.image;
    pixels.forEach((pixel, i) => {
      const light = isLit ? 0.3 + 0.9 * Math.max(dot(facing[i], sun), 0) : 1;
      color.forEach((channel, k) => {
        const value = Math.max(values[channels * i + channel], 0);
        data[4 * pixel + k] = Math.round(255 * (isLit ? value * light ** (1 / 2.2) : value));
      });
    });
  }

  // Shows the rows that are drawn, on all of the canvas.
  async show(rows) {
    const { image, context } = this, { canvas } = context;
    if (canvas.width === image.width && canvas.height === image.height)
      context.putImageData(image, 0, 0, 0, 0, image.width, rows);
    else if (rows === image.height)
      context.drawImage(await createImageBitmap(image), 0, 0, canvas.width, canvas.height);
  }
}
