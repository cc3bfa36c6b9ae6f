// Evaluates what a JSON file asks for and writes the values as hexadecimal bytes, one line a query.
// Errors of the package are lines that begin with their name.
import { readFileSync } from "node:fs";

const [, , index, file] = process.argv;
const { load, loadInWorkers } = await import(index);
const numbers = { NaN: NaN, Infinity: Infinity };
const parse = (_, value) => (typeof value === "string" && value in numbers ? numbers[value] : value);

for (const { model, bytes, options, workers, queries } of JSON.parse(readFileSync(file, "utf8"), parse)) {
  try {
    const source = bytes === undefined ? model : readFileSync(model).subarray(0, bytes);
    const texture = workers === undefined
      ? await load(source, options) : await loadInWorkers(source, { ...options, workers });
    console.log(JSON.stringify([texture.name, texture.family, texture.channels, texture.colorSpace]));
    for (const { box, points, options: where } of queries ?? []) {
      try {
        const values = await (box ? texture.evalBox(...box) : texture.evalPoints(points, where));
        console.log(Buffer.from(values.buffer).toString("hex"));
      } catch (error) {
        console.log(`${error.name} ${error.status}: ${error.message}`);
      }
    }
    texture.close();
  } catch (error) {
    console.log(`${error.name} ${error.status}: ${error.message}`);
  }
}
