// The solid in WebGPU: triangles, and the exported function in the fragment shader. The picture is
// copied to a 2D canvas: that works without a swap chain, too, and keeps it for PNG files.

const GPU_MAIN = `
struct View { settings: array<vec4<f32>, 8>, origin: vec4<i32> }
@group(1) @binding(0) var<uniform> view: View;
var<private> missing: u32 = 0u;  // brick of a lattice that a pixel lacks, and 1
struct Pixel { @location(0) color: vec4<f32>, @location(1) missing: u32 }
struct Vertex {
  @builtin(position) clip: vec4<f32>, @location(0) at: vec3<f32>, @location(1) facing: vec3<f32>
}

@vertex fn vertex(@location(0) position: vec3<f32>, @location(1) normal: vec3<f32>) -> Vertex {
  let s = view.settings;
  let clip = mat4x4<f32>(s[0], s[1], s[2], s[3]) * vec4<f32>(position, 1.0);
  return Vertex(clip, position, normal);
}

@fragment fn fragment(
  vertex: Vertex, @builtin(front_facing) front: bool
) -> Pixel {
  let eye = view.settings[4].xyz;
  var p = vertex.at;
  var n = normalize(vertex.facing);
  let cut = view.settings[5];
  if (view.settings[7].y > 0.5) {
    let below = cut.w - dot(cut.xyz, p);
    let height = dot(cut.xyz, eye) - cut.w;
    if (below < 0.0) { discard; }
    if (!front && height > 0.0) {  // the nearest face is a back: the ray enters where the solid is cut
      p = mix(eye, p, height / (height + below));
      n = cut.xyz;
    }
  }
  if (dot(n, eye - p) < 0.0) { n = -n; }
  let scale = view.settings[6].w;
  let footprint = 0.5 * scale * distance(eye, p) * view.settings[4].w * view.settings[7].z;
  var albedo = solidtex_solid_at(view.origin.xyz, scale * p + view.settings[6].xyz, footprint);
  if (view.settings[7].x > 0.5) {
    let light = 0.3 + 0.9 * max(dot(n, normalize(vec3<f32>(1.0, 2.0, 3.0))), 0.0);
    let linear = pow(max(albedo, vec3<f32>(0.0)), vec3<f32>(2.2));
    albedo = pow(light * linear, vec3<f32>(1.0 / 2.2));
  }
  return Pixel(vec4<f32>(albedo, 1.0), missing);
}`;

class GpuSampler {
  static async create(device, model) {
    return Object.assign(new GpuSampler(), { device, model, wgsl: model.wgsl });
  }

  destroy() { this.weights?.destroy(); }

  setSeed(seed) {
    const halves = seeded(this.model, seed), { width } = this.model;
    const size = [width, halves.length / 4 / width];
    const usage = GPUTextureUsage.TEXTURE_BINDING | GPUTextureUsage.COPY_DST;
    this.weights?.destroy();
    this.weights = this.device.createTexture({ size, format: "rgba16float", usage });
    this.device.queue.writeTexture(
      { texture: this.weights }, halves, { bytesPerRow: 8 * width }, size);
  }

  setPlace() {}
  resources() { return [this.weights.createView()]; }
  async refine() { return false; }
}

class WebGpuView {
  static near = 0;

  static async create(canvas, onLost) {
    const adapter = await navigator.gpu?.requestAdapter();
    const device = await adapter?.requestDevice();
    if (!device) return null;
    const context = canvas.getContext("2d");
    device.addEventListener("uncapturederror", ({ error }) => say(error.message));
    device.lost.then(({ message }) => onLost(`the graphics device was lost: ${message}`));
    return new WebGpuView(device, context);
  }

  constructor(device, context) {
    Object.assign(this, { device, context, name: "WebGPU", format: "rgba8unorm" });
    this.uniforms = device.createBuffer({ size: 144,
      usage: GPUBufferUsage.UNIFORM | GPUBufferUsage.COPY_DST });
  }

  setMesh(mesh) {
    this.vertices = [mesh.positions, mesh.normals].map((values) => {
      const usage = GPUBufferUsage.VERTEX | GPUBufferUsage.COPY_DST;
      const buffer = this.device.createBuffer({ size: values.byteLength, usage });
      this.device.queue.writeBuffer(buffer, 0, values);
      return buffer;
    });
    this.count = mesh.positions.length / 3;
  }

  async setModel(model) {
    this.material?.destroy();
    this.material = await (model.lattice ? GpuLattice : GpuSampler).create(
      this.device, model);
    const module = this.device.createShaderModule({ code: this.material.wgsl + GPU_MAIN });
    const buffers = [0, 1].map((shaderLocation) => (
      { arrayStride: 12, attributes: [{ shaderLocation, offset: 0, format: "float32x3" }] }));
    this.pipeline = await this.device.createRenderPipelineAsync({
      layout: "auto",
      vertex: { module, entryPoint: "vertex", buffers },
      fragment: { module, entryPoint: "fragment",
                  targets: [{ format: this.format }, { format: "r32uint" }] },
      depthStencil: { format: "depth32float", depthCompare: "less", depthWriteEnabled: true },
    });
  }

  setSeed(seed) { this.material.setSeed(seed); }
  setPlace(place, texels) { this.material.setPlace(place, texels); }
  refine(isCurrent) { return this.material.refine(this.missing, isCurrent); }

  begin(width, height) {
    if (this.target?.width !== width || this.target?.height !== height) {
      const usage = GPUTextureUsage.RENDER_ATTACHMENT | GPUTextureUsage.COPY_SRC
        | GPUTextureUsage.TEXTURE_BINDING;
      const texture = (format) => this.device.createTexture({ size: [width, height], format, usage });
      for (const old of [this.target, this.depth, this.missing]) old?.destroy();
      this.target = texture(this.format);
      this.depth = texture("depth32float");
      this.missing = texture("r32uint");
    }
    this.load = "clear";
  }

  async draw(settings, origin, [x, y, width, height]) {
    const { device, pipeline } = this;
    device.queue.writeBuffer(this.uniforms, 0, settings);
    device.queue.writeBuffer(this.uniforms, 128, origin);
    const encoder = device.createCommandEncoder();
    const pass = encoder.beginRenderPass({
      colorAttachments: [{ view: this.target.createView(), loadOp: this.load, storeOp: "store",
                           clearValue: [0.86, 0.86, 0.86, 1] },
                         { view: this.missing.createView(), loadOp: this.load, storeOp: "store" }],
      depthStencilAttachment: { view: this.depth.createView(), depthLoadOp: this.load,
                                depthStoreOp: "store", depthClearValue: 1 },
    });
    this.load = "load";
    const bound = (group, resources) => pass.setBindGroup(group, device.createBindGroup({
      layout: pipeline.getBindGroupLayout(group),
      entries: resources.map((resource, binding) => ({ binding, resource })) }));
    pass.setPipeline(pipeline);
    bound(0, this.material.resources());
    bound(1, [{ buffer: this.uniforms }]);
    this.vertices.forEach((buffer, i) => pass.setVertexBuffer(i, buffer));
    pass.setScissorRect(x, y, width, height);
    pass.draw(this.count);
    pass.end();
    device.queue.submit([encoder.finish()]);
    await device.queue.onSubmittedWorkDone();
  }

  // Shows the rows that are drawn, on all of the canvas.
  async show(rows) {
    const { width, height } = this.target, bytesPerRow = 256 * Math.ceil(width / 64);
    const usage = GPUBufferUsage.COPY_DST | GPUBufferUsage.MAP_READ;
    const buffer = this.device.createBuffer({ size: bytesPerRow * rows, usage });
    const encoder = this.device.createCommandEncoder();
    encoder.copyTextureToBuffer({ texture: this.target }, { buffer, bytesPerRow }, [width, rows]);
    this.device.queue.submit([encoder.finish()]);
    await buffer.mapAsync(GPUMapMode.READ);
    const bytes = new Uint8Array(buffer.getMappedRange());
    const image = new ImageData(width, rows);
    for (let y = 0; y < rows; ++y)
      image.data.set(bytes.subarray(y * bytesPerRow, y * bytesPerRow + 4 * width), 4 * y * width);
    buffer.destroy();
    const { canvas } = this.context;
    if (canvas.width === width && canvas.height === height) this.context.putImageData(image, 0, 0);
    else if (rows === height)
      this.context.drawImage(await createImageBitmap(image), 0, 0, canvas.width, canvas.height);
  }
}
