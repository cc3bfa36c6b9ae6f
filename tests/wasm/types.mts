// Compiles against index.d.ts. Lines after @ts-expect-error must not.
import { load, loadInWorkers, SolidtexError, type Texture } from "solidtex";

const texture: Texture = await load(new Uint8Array(), { precision: "fast", seed: 7n });
const values: Float32Array = texture.evalPoints([0, 0, 0], { origin: [1, 2, 3], radii: [0.5] });
const box: Float32Array = texture.evalBox([0, 0, 0], [8, 8, 8]);
// @ts-expect-error: a size has three numbers
texture.evalBox([0, 0, 0], [8, 8]);
const shared = await loadInWorkers("granite.solidtex", { workers: 2 });
const later: Float32Array = await shared.evalBox([0, 0, 0], [8, 8, 8]);
// @ts-expect-error: a promise
const now: Float32Array = shared.evalPoints([0, 0, 0]);
// @ts-expect-error: not for workers
await loadInWorkers("a.solidtex", { module: { create: async () => 0, wasm: new Uint8Array() } });
// @ts-expect-error: no such precision
await load("granite.solidtex", { precision: "half" });
console.log(new SolidtexError("text").status, values, box, later, now, texture.channels.length);
