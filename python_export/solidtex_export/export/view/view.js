// The page: controls, camera, and drawing in parts, so that no draw takes long.

const canvas = document.getElementById("canvas");
const control = (id) => document.getElementById(id);
const state = { model: 0, shape: "cube", texels: 512, cut: "", at: 0, place: [0, 0, 0], seed: "0",
                lit: true, filter: true, yaw: 0.6, pitch: 0.45, distance: 5.6, camera: null };
const BACKENDS = { webgpu: WebGpuView, webgl: WebGlView, webassembly: WebAssemblyView };
const OWN_SHAPES = new Set(Object.keys(SHAPES));
const FIELD_OF_VIEW = Math.PI / 5, COARSE = 4, SHOWN_EVERY_MS = 400;
const REMEDY = "write the page again with solidtex-view --wasm FOLDER, which draws by WebAssembly";
const GOLDEN = 0x9e3779b97f4a7c15n, MASK = (1n << 64n) - 1n;
let view = null, loaded = {}, generation = 0, moving = false, isLost = false;
let cut = { along: "", side: 1 };  // which half is gone: the one in front when the cut was chosen
let last = Promise.resolve();  // drawing

function say(message) {
  control("message").textContent = message;
  control("message").hidden = !message;
}

// Keys of the noise: docs/noise.md.
function mix64(value) {
  let z = value & MASK;
  z = ((z ^ (z >> 30n)) * 0xbf58476d1ce4e5b9n) & MASK;
  z = ((z ^ (z >> 27n)) * 0x94d049bb133111ebn) & MASK;
  return z ^ (z >> 31n);
}
function keyOf(seed, level, channel = 0) {
  const h = mix64(mix64(seed + GOLDEN) + (BigInt(level) << 32n | BigInt(channel)) + GOLDEN);
  const pairs = [mix64(h + GOLDEN), mix64(h + 2n * GOLDEN)];
  return pairs.flatMap((pair) => [Number(pair & 0xffffffffn), Number(pair >> 32n)]);
}
// A whole number below 2048 as a half.
function halfOf(value) {
  if (value === 0) return 0;
  const exponent = 31 - Math.clz32(value);
  return ((exponent + 15) << 10) | ((value << (10 - exponent)) & 0x3ff);
}
function seeded(model, seed) {
  model.halves ??= new Uint16Array(bytesOf(model.data));
  const halves = model.halves.slice();
  for (let octave = 0; octave < model.octaves; ++octave)
    keyOf(seed, octave).forEach((word, k) => {
      const first = 4 * (octave * model.octaveWords + k);
      [word & 0x7ff, (word >>> 11) & 0x7ff, word >>> 22].forEach((part, i) => {
        halves[first + i] = halfOf(part);
      });
    });
  return halves;
}

function bytesOf(text) {
  return Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer;
}

function readSeed(text) {
  if (!/^\d{1,20}$/.test(text) || BigInt(text) > MASK)
    throw new Error(`seed: found "${text}", expected a whole number from 0 to 2^64 - 1`);
  return BigInt(text);
}

function mostTexels(model) {
  return model.lattice ? view.constructor.mostTexels ?? MAX_TEXELS : 2048;
}

// Loads what changed since the last drawing. The state may change meanwhile.
async function load() {
  const model = MODELS[state.model], seed = readSeed(state.seed), makeMesh = SHAPES[state.shape];
  const isNew = loaded.model !== model;
  if (isNew) {
    loaded.model = null;
    control("progress").value = "compiling";
    await view.setModel(model);
    control("texels").max = mostTexels(model);
    state.texels = Math.min(state.texels, control("texels").max);
    showControls();
    control("exemplar").hidden = !model.exemplar;
    if (model.exemplar) control("exemplar").src = model.exemplar;
  }
  if (isNew || loaded.seed !== seed) view.setSeed(seed);
  if (loaded.makeMesh !== makeMesh) view.setMesh(makeMesh());
  loaded = { model, seed, makeMesh };
}

// The camera that the user turns. The shape is shown beside the controls where there is room.
function orbit(aspect) {
  const { yaw, pitch, distance } = state;
  const back = [Math.sin(yaw) * Math.cos(pitch), Math.sin(pitch), Math.cos(yaw) * Math.cos(pitch)];
  const panel = control("controls"), covered = panel.offsetWidth / canvas.clientWidth;
  const shift = panel.open && covered < 0.5 ? covered : 0, free = (1 - shift) * aspect;
  const half = Math.tan(FIELD_OF_VIEW / 2) / Math.min(1, free);
  return { eye: back.map((c) => distance * c), target: [0, 0, 0], shift,
           fieldOfView: 2 * Math.atan(half) };
}

function settingsOf(width, height) {
  const { eye, target, fieldOfView, shift = 0 } = state.camera ?? orbit(width / height);
  const clip = cameraMatrix(eye, target, fieldOfView, width / height, view.constructor.near, shift);
  const normal = [0, 0, 0], axis = "xyz".indexOf(state.cut || "x");
  if (cut.along !== state.cut) cut = { along: state.cut, side: eye[axis] < 0 ? -1 : 1 };
  normal[axis] = cut.side;
  const pixel = 2 * Math.tan(fieldOfView / 2) / height;
  return new Float32Array([...clip, ...eye, pixel, ...normal, cut.side * state.at, 0, 0, 0,
    state.texels / 2, Number(state.lit), Number(state.cut !== ""), Number(state.filter), 0]);
}

// Draws the state after the drawing before, which ends early. Returns "drawn", "replaced" by a newer
// drawing or the one after a move, or "failed".
function render() {
  const mine = ++generation;
  last = last.then(() => mine === generation ? renderNow(() => mine === generation) : "replaced");
  return last;
}

async function renderNow(isCurrent) {
  if (isLost) return "failed";
  const waiting = setTimeout(() => { control("progress").value ||= "drawn: 0 %"; }, SHOWN_EVERY_MS);
  try {
    await load();
    if (!isCurrent()) return "replaced";
    say("");
    const ratio = state.camera ? 1 : devicePixelRatio;
    const size = [canvas.clientWidth, canvas.clientHeight].map((s) => Math.max(1, Math.round(s * ratio)));
    if (canvas.width !== size[0]) canvas.width = size[0];
    if (canvas.height !== size[1]) canvas.height = size[1];
    view.setPlace(state.place, state.texels);
    const coarse = size.map((s) => Math.ceil(s / COARSE));
    const isFast = MODELS[state.model].lattice && !(view instanceof WebAssemblyView);
    if (!isFast && (!await drawn(coarse, isCurrent) || moving)) return "replaced";
    do {
      if (!await drawn(size, isCurrent)) return "replaced";
    } while (await view.refine(isCurrent));
    return "drawn";
  } catch (error) {
    if (!isLost) say(error.message);
    return "failed";
  } finally {
    clearTimeout(waiting);
    control("progress").value = "";
  }
}

// Draws once, in parts. Returns whether it came to an end, which a newer drawing prevents.
async function drawn([width, height], isCurrent) {
  const settings = settingsOf(width, height);
  view.begin(width, height);
  const { firstRows = 64, leastRows = 8 } = view.constructor;
  let edge = firstRows, shown = performance.now();
  for (let y = 0, rows; y < height; y += rows) {
    rows = Math.min(edge, height - y);
    const started = performance.now();
    await view.draw(settings, new Int32Array(state.place), [0, y, width, rows]);
    if (!isCurrent()) return false;
    const now = performance.now(), time = now - started;
    const wanted = edge * Math.min(2, 30 / Math.max(time, 1));
    edge = Math.round(Math.min(1024, Math.max(leastRows, wanted)));
    if (now - shown > SHOWN_EVERY_MS) {
      await view.show(y + rows);
      control("progress").value = `drawn: ${Math.floor(100 * (y + rows) / height)} %`;
      shown = performance.now();
    }
    if (!moving) await new Promise((done) => setTimeout(done));
    if (!isCurrent()) return false;
  }
  await view.show(height);
  return isCurrent();
}

async function set(changes) {
  Object.assign(state, changes);
  showControls();
  await render();
}

// A text stays as it is while somebody writes it.
function showControls() {
  for (const id of ["model", "shape", "texels", "cut", "at", "place", "seed"]) {
    const text = id === "place" ? state.place.join(", ") : state[id];
    if (control(id) !== document.activeElement) control(id).value = text;
  }
  for (const id of ["texels", "at"]) control(`${id}-value`).value = state[id];
  control("lit").checked = state.lit;
}

function readPlace(text) {
  const place = text.split(",").map((part) => part.trim() === "" ? NaN : Number(part));
  if (place.length !== 3 || !place.every((c) => Number.isInteger(c) && Math.abs(c) <= 2 ** 30))
    throw new Error(`place: found "${text}", expected three whole numbers up to 2^30, as 1, 2, 3`);
  return place;
}

async function showFile(file) {
  try {
    const own = readGlb(await file.arrayBuffer(), file.name);
    const name = OWN_SHAPES.has(file.name) ? `${file.name}.glb` : file.name;
    SHAPES[name] = () => own;
    if (![...control("shape").options].some(({ text }) => text === name))
      control("shape").add(new Option(name));
    await set({ shape: name });
  } catch (error) {
    const isDamaged = error instanceof TypeError || error instanceof RangeError;
    say(isDamaged ? `${file.name}: found a damaged file, expected a .glb file` : error.message);
  }
}

const readSeedText = (text) => String(readSeed(text));

// What the controls hold as text.
const READERS = { model: Number, shape: String, texels: Number, cut: String, at: Number,
                  place: readPlace, seed: readSeedText };

function numberOf(id, text, min, max) {
  const value = text.trim() === "" ? NaN : Number(text);
  if (!(value >= min && value <= max))
    throw new Error(`${id}: found "${text}", expected a number from ${min} to ${max}`);
  return value;
}

function oneOf(id, text, names) {
  if (names.includes(text)) return text;
  const expected = [names.slice(0, -1).join(", "), names.at(-1)].filter(Boolean).join(" or ");
  throw new Error(`${id}: found "${text}", expected ${expected}`);
}

// What the address may set. The model is first: it has a say in the number of texels.
const ADDRESS = {
  model(text) {
    const names = MODELS.map(({ name }) => name);
    return names.indexOf(oneOf("model", text, names));
  },
  shape: (text) => oneOf("shape", text, Object.keys(SHAPES)),
  texels: (text) => Math.min(numberOf("texels", text, 16, 2048), mostTexels(MODELS[state.model])),
  cut: (text) => text && oneOf("cut", text, ["x", "y", "z"]),
  at: (text) => numberOf("at", text, -1, 1),
  place: readPlace,
  seed: readSeedText,
};

// Sets the state. Returns what is wrong with the values that cannot be read, a line for each.
function readAddress(given) {
  const problems = [];
  for (const [id, read] of Object.entries(ADDRESS)) {
    if (!given.has(id)) continue;
    try {
      state[id] = read(given.get(id));
    } catch (error) {
      problems.push(error.message);
    }
  }
  return problems;
}

function listen() {
  for (const [id, read] of Object.entries(READERS)) {
    let isWrong = false;
    control(id).addEventListener("input", ({ target }) => {
      try {
        set({ [id]: read(target.value) });
        isWrong = false;
      } catch (error) {
        isWrong = true;
        say(error.message);
      }
    });
    control(id).addEventListener("blur", () => {
      showControls();  // a value that could not be read is gone, and its message
      if (isWrong) say("");
      isWrong = false;
    });
  }
  control("place").addEventListener("keydown", (e) => e.stopPropagation());
  control("lit").addEventListener("input", ({ target }) => set({ lit: target.checked }));
  const panel = control("controls");
  if (panel.offsetWidth > window.innerWidth / 2) panel.open = false;
  panel.querySelector("summary").addEventListener("click", () => setTimeout(render));
  panel.addEventListener("submit", (event) => event.preventDefault());
  control("png").addEventListener("click", async () => {
    let outcome;
    do outcome = await render(); while (outcome === "replaced");
    if (outcome === "failed") return;
    canvas.toBlob((blob) => {
      const link = document.createElement("a");
      link.href = URL.createObjectURL(blob);
      link.download = `${MODELS[state.model].name}.png`;
      link.click();
    });
  });
  control("file").addEventListener("change", ({ target }) => {
    if (target.files.length) showFile(target.files[0]);
  });
  listenToPointers();
  addEventListener("resize", render);
  addEventListener("dragover", (event) => event.preventDefault());
  addEventListener("drop", (event) => {
    event.preventDefault();
    if (event.dataTransfer.files.length) showFile(event.dataTransfer.files[0]);
  });
}

// One pointer turns the shape, two or the wheel come closer.
function listenToPointers() {
  const pointers = new Map();
  const spread = () => {
    const [a, b] = [...pointers.values()];
    return Math.max(1, Math.hypot(a.x - b.x, a.y - b.y));
  };
  const zoom = (factor) => {
    state.distance = Math.min(20, Math.max(1.2, state.distance * factor));
    return render();
  };
  const release = ({ pointerId }) => {
    if (!pointers.delete(pointerId) || pointers.size > 0) return;
    moving = false;
    render();
  };
  canvas.addEventListener("pointerdown", ({ pointerId, clientX: x, clientY: y }) => {
    canvas.setPointerCapture(pointerId);
    pointers.set(pointerId, { x, y });
  });
  canvas.addEventListener("pointermove", ({ pointerId, clientX: x, clientY: y }) => {
    const before = pointers.get(pointerId);
    if (!before) return;
    const wide = pointers.size === 2 ? spread() : 0;
    pointers.set(pointerId, { x, y });
    moving = true;
    if (wide) return zoom(wide / spread());
    state.yaw -= (x - before.x) / 150;
    state.pitch = Math.min(1.5, Math.max(-1.5, state.pitch + (y - before.y) / 150));
    render();
  });
  canvas.addEventListener("pointerup", release);
  canvas.addEventListener("pointercancel", release);
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    zoom(Math.exp(event.deltaY / 1000));
  });
}

// What to do where nothing can draw.
function withoutView(only) {
  if (only === "webassembly" && !ENGINE)
    return `found no WebAssembly in this page; ${REMEDY}, or open it without backend=${only}`;
  if (only) return `found no ${only} in this browser; open the page without backend=${only}`;
  return ENGINE
    ? "found no WebGPU, WebGL 2 or WebAssembly in this browser; open the page in another browser"
    : `found no WebGPU or WebGL 2 in this browser; ${REMEDY}`;
}

async function start() {
  const given = new URLSearchParams(location.search), problems = [];
  const lost = (message) => {
    isLost = true;
    say(`${message.replace(/\.$/, "")}; reload the page`);
  };
  let only = given.get("backend");
  try {
    if (only) oneOf("backend", only, Object.keys(BACKENDS));
  } catch (error) {
    problems.push(error.message);
    only = null;
  }
  for (const [name, View] of Object.entries(BACKENDS))
    if (!only || only === name) view ??= await View.create(canvas, lost).catch(() => null);
  if (!view) {
    control("controls").hidden = true;
    return say([...problems, withoutView(only)].join("\n"));
  }
  state.texels = view.constructor.texels ?? state.texels;
  MODELS.forEach((model, i) => control("model").add(new Option(model.name, i)));
  listen();
  problems.push(...readAddress(given));
  await set({});
  if (problems.length > 0)
    say([control("message").textContent, ...problems].filter(Boolean).join("\n"));
}

window.solidtex = { set, state, showFile, ready: start(), backend: () => view?.name };
