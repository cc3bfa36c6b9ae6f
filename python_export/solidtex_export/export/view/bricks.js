// Bricks of a lattice model: computed once they are visible, and kept in the slots of a 3D texture.
// A picture without new bricks costs a look-up in the texture for each pixel.

const BRICK = 32, PADDED = BRICK + 2;  // a voxel more on each side, for interpolation
const ATLAS = [8, 8, 16], SLOTS = 8 * 8 * 16;  // bricks
const MAX_TEXELS = 512, MAX_GRID = MAX_TEXELS / BRICK + 2;  // bricks along an axis of the view
const UNIFORM_PITCH = 256, LO = 16;  // bytes: of a pass's numbers, and where its first voxel is
const AT_ONCE = 4, ROUND_MS = 100;

// Subclasses compute bricks: compute(brick), finished(), missing() and write(offset).
class Bricks {
  slots = new Map();

  constructor(model) {
    const { passes, weights } = model.lattice;
    this.model = model;
    this.words = new Uint32Array(bytesOf(weights));
    this.numbers = new Uint8Array(UNIFORM_PITCH * (passes.length + 1));
    passes.forEach(({ uniform }, i) =>
      this.numbers.set(new Uint8Array(bytesOf(uniform)), UNIFORM_PITCH * i));
  }

  setSeed(seed) {
    for (const { noise } of this.model.lattice.passes)
      for (let channel = 0; channel < (noise?.keys ?? 0); ++channel)
        this.words.set(keyOf(seed, noise.level, channel), 4 * (noise.weights + channel));
    this.slots.clear();
  }

  // Bricks that a shape of so many texels around a place can touch.
  setPlace(place, texels) {
    this.base = place.map((c) => Math.floor((c - texels / 2) / BRICK));
    this.count = Math.min(MAX_GRID, Math.ceil(texels / BRICK) + 1);
    this.offset = place.map((c, axis) => c - BRICK * this.base[axis]);
    this.computed = 0;
    this.write();
  }

  brickAt(index) {
    const { base, count } = this;
    return [base[0] + Math.floor(index / count ** 2), base[1] + Math.floor(index / count) % count,
            base[2] + index % count];
  }

  // Slot of each brick of the view and 1, or 0.
  table() {
    return Uint32Array.from({ length: this.count ** 3 },
                            (_, index) => (this.slots.get(`${this.brickAt(index)}`) ?? -1) + 1);
  }

  // Computes bricks that pixels lack. Returns whether there were any.
  async refine(pixels, isCurrent) {
    const missing = await this.missing(pixels), started = performance.now();
    const lacked = missing.length > 0;
    this.computed += missing.length;
    if (this.computed > SLOTS)
      throw new Error(`found ${this.computed} visible bricks, expected at most ${SLOTS}: show fewer`
                      + " texels across");
    while (missing.length && isCurrent() && performance.now() - started < ROUND_MS) {
      missing.splice(0, AT_ONCE).forEach((index) => this.compute(this.brickAt(index)));
      await this.finished();
    }
    this.computed -= missing.length;
    this.write();
    return lacked;
  }

  // Writes where a brick's noise begins into the numbers of the passes.
  setBrick(brick) {
    const view = new DataView(this.numbers.buffer);
    this.model.lattice.passes.forEach(({ noise }, i) => noise?.lo.forEach((first, axis) =>
      view.setInt32(UNIFORM_PITCH * i + LO + 4 * axis, first + brick[axis] * (BRICK >> noise.level),
                    true)));
  }

  // Takes a free slot, or that of the oldest brick. Returns its first voxel in the atlas.
  cornerFor(brick) {
    let slot = this.slots.size;
    if (slot === SLOTS) {
      const [oldest, freed] = this.slots.entries().next().value;
      this.slots.delete(oldest);
      slot = freed;
    }
    this.slots.set(`${brick}`, slot);
    return [slot % ATLAS[0], Math.floor(slot / ATLAS[0]) % ATLAS[1],
            Math.floor(slot / ATLAS[0] / ATLAS[1])].map((bricks) => PADDED * bricks);
  }
}
