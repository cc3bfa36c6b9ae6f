// Lattice models in WebGPU: compute passes fill bricks.

const LATTICE_LOOK_UP = `
struct Grid { offset: vec3<i32>, count: i32 }
@group(0) @binding(0) var atlas: texture_3d<f32>;
@group(0) @binding(1) var linear: sampler;
@group(0) @binding(2) var<storage, read> slots: array<u32>;
@group(0) @binding(3) var<uniform> grid: Grid;

fn solidtex_solid_at(origin: vec3<i32>, texel: vec3<f32>, footprint: f32) -> vec3<f32> {
  let p = texel + vec3<f32>(grid.offset);
  let brick = clamp(vec3<i32>(floor(p / ${BRICK}.0)), vec3<i32>(0), vec3<i32>(grid.count - 1));
  let index = (brick.x * grid.count + brick.y) * grid.count + brick.z;
  if (slots[index] == 0u) {
    missing = u32(index) + 1u;
    return vec3<f32>(0.6);
  }
  let slot = i32(slots[index]) - 1;
  let corner = ${PADDED} * vec3<i32>(slot % ${ATLAS[0]}, slot / ${ATLAS[0]} % ${ATLAS[1]},
                                     slot / ${ATLAS[0] * ATLAS[1]});
  let at = vec3<f32>(corner) + 1.0 + p - vec3<f32>(${BRICK} * brick);
  return textureSampleLevel(atlas, linear, at / vec3<f32>(textureDimensions(atlas)), 0.0).rgb;
}`;

const LATTICE_STORE = (color) => `
@group(0) @binding(0) var<uniform> corner: vec4<i32>;
@group(0) @binding(1) var<storage, read> values: array<vec4<f32>>;
@group(0) @binding(2) var atlas: texture_storage_3d<rgba8unorm, write>;

fn channel(index: i32, voxel: i32) -> f32 {
  return values[index / 4 * ${PADDED ** 3} + voxel][index % 4];
}
@compute @workgroup_size(4, 4, 4) fn main(@builtin(global_invocation_id) id: vec3<u32>) {
  let p = vec3<i32>(id);
  if (any(p >= vec3<i32>(${PADDED}))) { return; }
  let voxel = (p.x * ${PADDED} + p.y) * ${PADDED} + p.z;
  let color = vec3<f32>(${color.map((c) => `channel(${c}, voxel)`).join(", ")});
  textureStore(atlas, corner.xyz + p, vec4<f32>(color, 1.0));
}`;

const LATTICE_GATHER = `
@group(0) @binding(0) var pixels: texture_2d<u32>;
@group(0) @binding(1) var<storage, read_write> is_missing: array<u32>;

@compute @workgroup_size(8, 8) fn main(@builtin(global_invocation_id) id: vec3<u32>) {
  if (any(id.xy >= textureDimensions(pixels))) { return; }
  let index = textureLoad(pixels, id.xy, 0).x;
  if (index > 0u) { is_missing[index - 1u] = 1u; }
}`;

class GpuLattice extends Bricks {
  wgsl = LATTICE_LOOK_UP;

  static async create(device, model) {
    const material = new GpuLattice(model);
    Object.assign(material, { device, tensors: {} });
    const { lattice } = model, usage = GPUBufferUsage;
    const make = (code, entryPoint) => device.createComputePipelineAsync(
      { layout: "auto", compute: { module: device.createShaderModule({ code }), entryPoint } });
    const entries = [...new Set(lattice.passes.map(({ entry }) => entry))];
    const made = await Promise.all(entries.map((entry) => make(lattice.wgsl, entry)));
    material.pipelines = Object.fromEntries(entries.map((entry, i) => [entry, made[i]]));
    material.store = await make(LATTICE_STORE(lattice.color), "main");
    material.gather = await make(LATTICE_GATHER, "main");
    const buffer = (size, use) => device.createBuffer({ size, usage: use });
    lattice.passes.forEach(({ tensor, elements }) => {
      material.tensors[tensor] = buffer(16 * elements, usage.STORAGE);
    });
    material.uniforms = buffer(material.numbers.length, usage.UNIFORM | usage.COPY_DST);
    material.weights = buffer(material.words.byteLength, usage.STORAGE | usage.COPY_DST);
    material.grid = buffer(16, usage.UNIFORM | usage.COPY_DST);
    const cells = 4 * MAX_GRID ** 3;
    material.slotTable = buffer(cells, usage.STORAGE | usage.COPY_DST);
    material.found = buffer(cells, usage.STORAGE | usage.COPY_SRC | usage.COPY_DST);
    material.answer = buffer(cells, usage.COPY_DST | usage.MAP_READ);
    material.atlas = device.createTexture({
      size: ATLAS.map((bricks) => bricks * PADDED), dimension: "3d", format: "rgba8unorm",
      usage: GPUTextureUsage.TEXTURE_BINDING | GPUTextureUsage.STORAGE_BINDING });
    material.sampler = device.createSampler({ minFilter: "linear", magFilter: "linear" });
    material.bound = lattice.passes.map((pass, i) => material.bind(pass, i));
    material.boundStore = material.group(material.store, [
      { buffer: material.uniforms, offset: UNIFORM_PITCH * lattice.passes.length, size: 16 },
      { buffer: material.tensors[lattice.output] }, material.atlas.createView()]);
    return material;
  }

  destroy() {
    for (const buffer of [...Object.values(this.tensors), this.uniforms, this.weights, this.grid,
                          this.slotTable, this.found, this.answer, this.atlas]) buffer.destroy();
  }

  group(pipeline, resources) {
    const entries = Object.entries(resources).map(
      ([binding, resource]) => ({ binding: Number(binding), resource }));
    return this.device.createBindGroup({ layout: pipeline.getBindGroupLayout(0), entries });
  }

  bind({ entry, tensor, sources, reads_weights, uniform }, index) {
    const resources = { 4: { buffer: this.tensors[tensor] },
      0: { buffer: this.uniforms, offset: UNIFORM_PITCH * index, size: bytesOf(uniform).byteLength } };
    if (reads_weights) resources[1] = { buffer: this.weights };
    sources.forEach((source, i) => { resources[2 + i] = { buffer: this.tensors[source] }; });
    return this.group(this.pipelines[entry], resources);
  }

  setSeed(seed) {
    super.setSeed(seed);
    this.device.queue.writeBuffer(this.weights, 0, this.words);
  }

  write() {
    const { device: { queue } } = this;
    queue.writeBuffer(this.grid, 0, new Int32Array([...this.offset, this.count]));
    queue.writeBuffer(this.slotTable, 0, this.table());
  }

  resources() {
    return [this.atlas.createView(), this.sampler, { buffer: this.slotTable }, { buffer: this.grid }];
  }

  finished() { return this.device.queue.onSubmittedWorkDone(); }

  async missing(pixels) {
    const { device, found, answer } = this, size = 4 * this.count ** 3;
    const encoder = device.createCommandEncoder();
    encoder.clearBuffer(found);
    const pass = encoder.beginComputePass();
    pass.setPipeline(this.gather);
    pass.setBindGroup(0, this.group(this.gather, [pixels.createView(), { buffer: found }]));
    pass.dispatchWorkgroups(Math.ceil(pixels.width / 8), Math.ceil(pixels.height / 8));
    pass.end();
    encoder.copyBufferToBuffer(found, 0, answer, 0, size);
    device.queue.submit([encoder.finish()]);
    await answer.mapAsync(GPUMapMode.READ, 0, size);
    const marks = new Uint32Array(answer.getMappedRange(0, size).slice());
    answer.unmap();
    const result = [];
    marks.forEach((mark, index) => { if (mark) result.push(index); });
    return result;
  }

  compute(brick) {
    const { device, numbers, model: { lattice } } = this, view = new DataView(numbers.buffer);
    this.setBrick(brick);
    this.cornerFor(brick).forEach((first, axis) =>
      view.setInt32(UNIFORM_PITCH * lattice.passes.length + 4 * axis, first, true));
    device.queue.writeBuffer(this.uniforms, 0, numbers);
    const encoder = device.createCommandEncoder(), pass = encoder.beginComputePass();
    lattice.passes.forEach(({ entry, workgroups }, i) => {
      pass.setPipeline(this.pipelines[entry]);
      pass.setBindGroup(0, this.bound[i]);
      pass.dispatchWorkgroups(...workgroups);
    });
    pass.setPipeline(this.store);
    pass.setBindGroup(0, this.boundStore);
    pass.dispatchWorkgroups(...Array(3).fill(Math.ceil(PADDED / 4)));
    pass.end();
    device.queue.submit([encoder.finish()]);
  }
}
