// Loads the engine's modules and wraps its C functions. index.d.ts documents the interface.

const isNode = typeof process === "object" && Boolean(process.versions?.node);
const MAX_MEMORY = 2 ** 31; // that of the modules
const PAGE = 65536;
const INVALID_ARGUMENT = 1, OUT_OF_MEMORY = 4, INTERNAL_ERROR = 5; // solidtex_status
const MAX_WORKERS = 256;
const MAX_SHOWN = 8; // numbers of an array in a message
const modules = new Map(); // promises, by precision and folder or by `create`
const OPTIONS = ["precision", "seed", "period", "cacheLimitBytes", "baseUrl"];
const QUERY_OPTIONS = ["origin", "radii"];

export class SolidtexError extends Error {
  constructor(message, status = INVALID_ARGUMENT) {
    super(message);
    this.name = "SolidtexError";
    this.status = status;
  }
}

function show(value) {
  if (typeof value === "string") return JSON.stringify(value);
  if (typeof value === "bigint") return `${value}n`;
  if (typeof value === "function") return "a function";
  if (typeof value !== "object" || value === null) return String(value);
  if (Array.isArray(value) || ArrayBuffer.isView(value)) {
    const shown = Array.from(value.slice?.(0, MAX_SHOWN) ?? [], show).join(",");
    return `[${shown}${value.length > MAX_SHOWN ? ", ..." : ""}]`;
  }
  return value instanceof URL ? value.href : `{${Object.keys(value).join(", ")}}`;
}
const refuseFound = (what, found, expected) => {
  throw new SolidtexError(`${what}: found ${found}, expected ${expected}`);
};
const refuse = (what, value, expected) => refuseFound(what, show(value), expected);

const either = (names) => `${names.slice(0, -1).join(", ")} or ${names.at(-1)}`;

// Returns an object of options, of which none is unknown.
function optionsOf(given, names, what = "options") {
  if (given === undefined) return {};
  if (given === null || typeof given !== "object" || Array.isArray(given))
    refuse(what, given, `an object with ${either(names)}`);
  for (const name of Object.keys(given))
    if (!names.includes(name)) refuseFound(what, name, either(names));
  return given;
}

function wholeNumber(what, value, max, min = 0) {
  const isWhole = typeof value === "bigint" || Number.isSafeInteger(value);
  if (!isWhole || value < min || value > max) {
    const kind = max > Number.MAX_SAFE_INTEGER ? ", above 2^53 - 1 as a bigint" : "";
    refuse(what, value, `a whole number from ${min} to ${max}${kind}`);
  }
  return BigInt(value);
}

// Address of a folder, with a slash at its end.
function folderOf(baseUrl) {
  if (baseUrl === undefined) return undefined;
  let url;
  try {
    url = new URL(String(baseUrl).replace(/\/?$/, "/"));
  } catch {} // refused below
  if (!url || (isNode && url.protocol !== "file:"))
    refuse("baseUrl", baseUrl, isNode ? "a file: URL" : "an absolute URL");
  return url.href;
}

// The modules that a page carries.
function carried(given) {
  if (given === undefined) return undefined;
  const { create, wasm } = optionsOf(given, ["create", "wasm"], "module");
  if (typeof create !== "function") refuse("module.create", create, "a function");
  if (typeof wasm?.byteLength !== "number")
    refuse("module.wasm", wasm, "the bytes of a .wasm file");
  return given;
}

function vector(what, value, isValid, expected) {
  const given = Array.from(value ?? []);
  if (given.length !== 3 || !given.every(isValid)) refuse(what, value, expected);
  return given;
}

function floats(what, value, isLength, expected) {
  if (value === null || typeof value !== "object" || typeof value.length !== "number")
    refuse(what, value, `an array of ${expected}`);
  if (!isLength(value.length)) refuseFound(what, `${value.length} numbers`, expected);
  return value instanceof Float32Array ? value : Float32Array.from(value);
}

async function read(model) {
  if (model instanceof Uint8Array) return model;
  if (model instanceof ArrayBuffer) return new Uint8Array(model);
  if (typeof model !== "string" && !(model instanceof URL))
    refuse("model", model, "bytes, a URL or a path");
  const isAddress = /^(?!file:)[a-z]+:\/\//i;
  const isFile = model instanceof URL ? model.protocol === "file:" : !isAddress.test(model);
  if (isNode && isFile) {
    const { readFile } = await import("node:fs/promises");
    const path = /^file:/i.test(model) ? new URL(model) : model;
    return readFile(path).catch((error) => {
      throw new SolidtexError(`${model}: cannot read: ${error.code ?? error.message}`, 2);
    });
  }
  const response = await fetch(model).catch((error) => {
    const { code, message } = error.cause ?? error;
    throw new SolidtexError(`${model}: cannot read: ${code ?? message}`, 2);
  });
  if (!response.ok) throw new SolidtexError(`${model}: cannot read: HTTP ${response.status}`, 2);
  return new Uint8Array(await response.arrayBuffer());
}

async function instantiate(precision, folder, given) {
  const name = `solidtex-${precision}`;
  const url = (file) => new URL(file, folder).href;
  const memory = new WebAssembly.Memory({ initial: 2 ** 26 / PAGE, maximum: MAX_MEMORY / PAGE });
  let { create, wasm: wasmBinary } = given ?? {}, locateFile = url;
  if (given) {
    locateFile = (file) => file;
  } else if (isNode) {
    const { createRequire } = await import("node:module");
    const { fileURLToPath } = await import("node:url");
    create = createRequire(folder)(`./${name}.js`);
    locateFile = (file) => fileURLToPath(url(file));
    // Emscripten 3.1.6 would fetch the path.
    wasmBinary = await (await import("node:fs/promises")).readFile(locateFile(`${name}.wasm`));
  } else {
    create = (await import(/* @vite-ignore */ /* webpackIgnore: true */ url(`${name}.mjs`))).default;
  }
  const module = await create({
    wasmMemory: memory,
    locateFile,
    ...(wasmBinary && { wasmBinary }),
  });
  return { module, memory };
}

// Instantiates a module once. A failure is not kept: the next call tries again.
async function engineOf(precision, folder, given) {
  const key = given?.create ?? `${precision} ${folder}`;
  if (!modules.has(key)) modules.set(key, instantiate(precision, folder, given));
  try {
    return await modules.get(key);
  } catch (error) {
    modules.delete(key);
    const what = given ? "module" : `${folder.replace(/[^/]*$/, "")}solidtex-${precision}`;
    throw new SolidtexError(`${what}: cannot load: ${error.code ?? error.message ?? error}`, 2);
  }
}

// Memory of one call, freed at its end.
class Scratch {
  constructor({ module, memory }) {
    this.module = module;
    this.memory = memory;
    this.blocks = [];
  }

  allocate(bytes, what) {
    const block = bytes < MAX_MEMORY ? this.module._malloc(Math.max(bytes, 8)) : 0;
    if (block === 0)
      throw new SolidtexError(
        `${what} needs ${bytes} bytes: more than the memory of the module, ${MAX_MEMORY} bytes in `
        + "all, has left; ask for less at a time", OUT_OF_MEMORY);
    this.blocks.push(block);
    return block;
  }

  // Memory grows: views are made when they are needed.
  view(Type, block, length) {
    return new Type(this.memory.buffer, block, length);
  }

  copy(values, what) {
    const block = this.allocate(values.byteLength, what);
    this.view(values.constructor, block, values.length).set(values);
    return block;
  }

  text(value) {
    return this.copy(new TextEncoder().encode(`${value}\0`), "text");
  }

  free() {
    for (const block of this.blocks) this.module._free(block);
  }
}

class Texture {
  #engine;
  #handle;

  constructor(engine) {
    this.#engine = engine;
    this.#handle = engine.module._solidtex_new();
    if (!this.#handle) throw new SolidtexError("no memory is left", OUT_OF_MEMORY);
  }

  // Calls use(scratch), which returns a status, and throws the engine's error.
  #call(use) {
    if (!this.#handle) throw new SolidtexError("texture is closed");
    const { module } = this.#engine;
    const scratch = new Scratch(this.#engine);
    try {
      module._solidtex_clear_error();
      const { status, result } = use(scratch, module, this.#handle);
      if (status !== 0)
        throw new SolidtexError(module.UTF8ToString(module._solidtex_error_message()), status);
      return result?.();
    } finally {
      scratch.free();
    }
  }

  _open(bytes, parameters) {
    for (const [name, value] of Object.entries(parameters))
      this.#call((scratch, module, handle) => ({
        status: module._solidtex_set_integer(handle, scratch.text(name), value),
      }));
    this.#call((scratch, module, handle) => ({
      status: module._solidtex_open_memory(handle, scratch.copy(bytes, "model"), bytes.length),
    }));
    const { module } = this.#engine;
    const text = (name, ...rest) =>
      module.UTF8ToString(module[`_solidtex_${name}`](this.#handle, ...rest));
    this.name = text("name");
    this.colorSpace = text("color_space");
    this.metadata = JSON.parse(text("metadata_json"));
    this.family = module._solidtex_get_family(this.#handle) === 1 ? "sampler" : "lattice";
    const count = module._solidtex_channel_count(this.#handle);
    this.channels = Array.from({ length: count }, (_, channel) => text("channel_name", channel));
  }

  evalPoints(points, options) {
    const { origin = [0, 0, 0], radii } = optionsOf(options, QUERY_OPTIONS);
    const given = floats("points", points, (n) => n % 3 === 0, "x, y, z of every point");
    const count = given.length / 3;
    const from = vector("origin", origin, (x) => typeof x === "number", "three numbers");
    const edges = radii === undefined ? undefined
      : floats("radii", radii, (n) => n === count, `one radius for each of ${count} points`);
    return this.#call((scratch, module, handle) => {
      const size = count * this.channels.length;
      const values = scratch.allocate(4 * size, `a result of ${count} points`);
      const footprints = edges
        ? scratch.copy(Uint32Array.of(12, scratch.copy(edges, "radii"), 0), "footprints") : 0;
      const status = module._solidtex_eval(
        handle, scratch.copy(Float64Array.from(from), "origin"), scratch.copy(given, "points"),
        footprints, count, values, 0);
      return { status, result: () => scratch.view(Float32Array, values, size).slice() };
    });
  }

  evalBox(origin, size) {
    const isWhole = (x) => Number.isSafeInteger(x);
    const from = vector("origin", origin, isWhole, "three whole numbers");
    const edges = vector("size", size, isWhole, "three whole numbers");
    return this.#call((scratch, module, handle) => {
      const length = edges.reduce((a, b) => a * Math.max(b, 0), this.channels.length);
      const values = scratch.allocate(4 * length, `a box of ${edges.join(" x ")} voxels`);
      const whole = (v) => scratch.copy(BigInt64Array.from(v, BigInt), "box");
      const status = module._solidtex_eval_box(handle, whole(from), whole(edges), values);
      return { status, result: () => scratch.view(Float32Array, values, length).slice() };
    });
  }

  close() {
    if (this.#handle) this.#engine.module._solidtex_release(this.#handle);
    this.#handle = 0;
  }
}

export async function load(model, options) {
  const { precision = "exact", seed = 0, period = 0, cacheLimitBytes = 2 ** 28, baseUrl,
          module } = optionsOf(options, [...OPTIONS, "module"]);
  const folder = folderOf(baseUrl) ?? import.meta.url;
  if (precision !== "exact" && precision !== "fast")
    refuse("precision", precision, '"exact" or "fast"');
  const parameters = {
    seed: wholeNumber("seed", seed, 2n ** 64n - 1n),
    period: wholeNumber("period", period, 2 ** 30),
    cache_limit_bytes: wholeNumber("cacheLimitBytes", cacheLimitBytes, MAX_MEMORY),
  };
  const given = carried(module);
  const bytes = await read(model);
  const texture = new Texture(await engineOf(precision, folder, given));
  try {
    texture._open(bytes, parameters);
  } catch (error) {
    texture.close();
    throw error;
  }
  return texture;
}

// A worker: call() evaluates there. Under Node it keeps the process alive during calls alone.
class Remote {
  #calls = new Map(); // by id: resolve and reject
  #count = 0;

  static async start(folder) {
    const remote = new Remote();
    const NodeWorker = isNode && (await import("node:worker_threads")).Worker;
    const url = folder && new URL("worker.mjs", folder);
    // Bundlers look for this form.
    remote.worker = isNode ? new NodeWorker(url ?? new URL("./worker.mjs", import.meta.url))
      : url ? new Worker(url, { type: "module" })
      : new Worker(new URL("./worker.mjs", import.meta.url), { type: "module" });
    const ready = new Promise((resolve, reject) => remote.#calls.set(undefined, [resolve, reject]));
    const fail = (event) => remote.#fail(`a worker failed: ${event.message ?? "cannot load it"}`);
    if (isNode) remote.worker.on("message", (data) => remote.#take(data)).on("error", fail);
    else {
      remote.worker.onmessage = (event) => remote.#take(event.data);
      remote.worker.onerror = fail;
    }
    await ready;
    return remote;
  }

  #take([id, result, refusal]) {
    const waiting = this.#calls.get(id);
    if (!waiting) return; // the worker failed or was closed
    const [resolve, reject] = waiting;
    this.#calls.delete(id);
    if (this.#calls.size === 0) this.worker.unref?.();
    if (refusal) reject(new SolidtexError(...refusal));
    else resolve(result);
  }

  #fail(message) {
    this.failure = message;
    for (const [, reject] of this.#calls.values())
      reject(new SolidtexError(message, INTERNAL_ERROR));
    this.#calls.clear();
  }

  call(method, ...given) {
    if (this.failure) return Promise.reject(new SolidtexError(this.failure, INTERNAL_ERROR));
    this.worker.ref?.();
    const id = this.#count++;
    return new Promise((resolve, reject) => {
      this.#calls.set(id, [resolve, reject]);
      this.worker.postMessage([id, method, given]);
    });
  }

  close() {
    this.worker.terminate();
    this.#fail("texture is closed");
  }
}

// [begin, end) of `count` nearly equal parts of [0, length), without empty ones.
function split(length, count) {
  const ends = Array.from({ length: count + 1 }, (_, i) => Math.floor((i * length) / count));
  return ends.slice(1).map((end, i) => [ends[i], end]).filter(([begin, end]) => begin < end);
}

const replaced = (vector, axis, value) => vector.map((x, i) => (i === axis ? value : x));

class WorkersTexture {
  #remotes;

  constructor(remotes, facts) {
    this.#remotes = remotes;
    Object.assign(this, facts);
  }

  // Evaluates parts of [0, length) by evaluate(remote, begin, end). A refusal numbers what it names
  // from the first of its part, so all together, refused for the same reason, give its message.
  #share(length, evaluate) {
    const parts = split(length, this.#remotes.length);
    return Promise.all(parts.map(([begin, end], i) => evaluate(this.#remotes[i], begin, end)))
      .catch((error) => {
        if (error.status !== INVALID_ARGUMENT) throw error;
        return evaluate(this.#remotes[0], 0, length);
      });
  }

  async evalPoints(points, options) {
    const { origin, radii } = optionsOf(options, QUERY_OPTIONS);
    const given = floats("points", points, (n) => n % 3 === 0, "x, y, z of every point");
    const count = given.length / 3;
    const edges = radii === undefined ? undefined
      : floats("radii", radii, (n) => n === count, `one radius for each of ${count} points`);
    const evaluate = (remote, begin, end) => remote.call(
      "evalPoints", given.slice(3 * begin, 3 * end),
      { origin, radii: edges && edges.slice(begin, end) });
    const parts = await this.#share(count, evaluate);
    const values = new Float32Array(count * this.channels.length);
    let at = 0;
    for (const part of parts) {
      values.set(part, at);
      at += part.length;
    }
    return values;
  }

  async evalBox(origin, size) {
    const [first] = this.#remotes;
    const isWhole = (v) => v?.length === 3 && v.every((x) => Number.isSafeInteger(x));
    if (!isWhole(origin) || !isWhole(size) || size.some((edge) => edge < 1))
      return first.call("evalBox", origin, size); // which refuses it, or has nothing to do
    const axis = size.indexOf(Math.max(...size));
    const parts = await this.#share(size[axis], (remote, begin, end) => remote.call(
      "evalBox", replaced(origin, axis, origin[axis] + begin), replaced(size, axis, end - begin)));
    const product = (edges) => edges.reduce((a, b) => a * b, 1);
    const blocks = product(size.slice(0, axis));
    const row = product(size.slice(axis + 1)) * this.channels.length; // values of one step
    const values = new Float32Array(product(size) * this.channels.length);
    split(size[axis], this.#remotes.length).forEach(([begin, end], i) => {
      const length = (end - begin) * row;
      for (let block = 0; block < blocks; ++block)
        values.set(parts[i].subarray(block * length, (block + 1) * length),
                   (block * size[axis] + begin) * row);
    });
    return values;
  }

  close() {
    for (const remote of this.#remotes) remote.close();
  }
}

async function processors() {
  if (globalThis.navigator?.hardwareConcurrency) return navigator.hardwareConcurrency;
  return isNode ? (await import("node:os")).cpus().length : 1;
}

export async function loadInWorkers(model, given) {
  const { workers, ...options } = optionsOf(given, [...OPTIONS, "workers"]);
  const wanted = workers ?? Math.min(await processors(), MAX_WORKERS);
  const count = Number(wholeNumber("workers", wanted, MAX_WORKERS, 1));
  const folder = folderOf(options.baseUrl);
  const bytes = await read(model);
  const remotes = [];
  try {
    for (let i = 0; i < count; ++i) remotes.push(await Remote.start(folder));
    const facts = await Promise.all(
      remotes.map((remote) => remote.call("load", bytes, { ...options, baseUrl: folder })));
    return new WorkersTexture(remotes, facts[0]);
  } catch (error) {
    for (const remote of remotes) remote.close();
    throw error;
  }
}
