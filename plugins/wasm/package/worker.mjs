// One worker of loadInWorkers. It answers [id, method, arguments] with [id, result] or with
// [id, undefined, [message, status]].
import { load } from "./index.mjs";

let port, texture;

const methods = {
  async load(bytes, options) {
    texture = await load(bytes, options);
    const { name, family, channels, colorSpace, metadata } = texture;
    return { name, family, channels, colorSpace, metadata };
  },
  evalPoints: (...given) => texture.evalPoints(...given),
  evalBox: (...given) => texture.evalBox(...given),
};

async function answer([id, method, given]) {
  try {
    const result = await methods[method](...given);
    port.postMessage([id, result], result instanceof Float32Array ? [result.buffer] : []);
  } catch (error) {
    port.postMessage([id, undefined, [error.message, error.status]]);
  }
}

if (typeof self === "object") {
  port = self;
  port.onmessage = (event) => answer(event.data);
  port.postMessage([]); // ready: earlier messages would be lost
} else {
  import("node:worker_threads").then(({ parentPort }) => {
    port = parentPort;
    port.on("message", answer);
    port.postMessage([]);
  });
}
