// The script of a worker: answers [id, method, arguments] with [id, result] or [id, undefined,
// message]. The npm package comes as text, since pages that are files cannot start modules.
let engine, wasm, texture, last = Promise.resolve();
const methods = {
  start: async (script, bytes) => {
    engine = await import(URL.createObjectURL(new Blob([script], { type: "text/javascript" })));
    wasm = bytes;
    await WebAssembly.compile(wasm);
  },
  load: async (file, options) => {
    texture?.close();
    texture = null;
    texture = await engine.load(file, { ...options, module: { create: engine.default, wasm } });
  },
  evalPoints: (...given) => texture.evalPoints(...given),
};
async function answer([id, method, given]) {
  try {
    postMessage([id, await methods[method](...given)]);
  } catch ({ message }) {
    postMessage([id, undefined, message]);
  }
}
onmessage = ({ data }) => {
  last = last.then(() => answer(data));
};
