// Lattice models in WebGL 2: fragment shaders fill bricks, each pass a texture.

const ROW = 2048;  // elements of four channels in a row of a texture
const TABLE_ROW = 128;
const LATTICE_FRAGMENTS = /*FRAGMENTS*/"";

const GL_LATTICE_LOOK_UP = `
precision highp float;
precision highp int;
uniform highp sampler3D atlas;
uniform highp usampler2D slots;
uniform ivec4 grid;  // offset, bricks along an axis
vec3 solidtex_solid_at(ivec3 origin, vec3 texel, float footprint) {
  vec3 p = texel + vec3(grid.xyz);
  ivec3 brick = clamp(ivec3(floor(p / ${BRICK}.0)), ivec3(0), ivec3(grid.w - 1));
  int index = (brick.x * grid.w + brick.y) * grid.w + brick.z;
  int slot = int(texelFetch(slots, ivec2(index % ${TABLE_ROW}, index / ${TABLE_ROW}), 0).x) - 1;
  if (slot < 0) {
    missing = uint(index) + 1u;
    return vec3(0.6);
  }
  ivec3 corner = ${PADDED} * ivec3(slot % ${ATLAS[0]}, slot / ${ATLAS[0]} % ${ATLAS[1]},
                                   slot / ${ATLAS[0] * ATLAS[1]});
  vec3 at = vec3(corner) + 1.0 + p - vec3(${BRICK} * brick);
  return textureLod(atlas, at / vec3(textureSize(atlas, 0)), 0.0).rgb;
}`;

const GL_WHOLE = `#version 300 es
void main() {
  gl_Position = vec4(4.0 * vec2(gl_VertexID & 1, gl_VertexID >> 1) - 1.0, 0.0, 1.0);
}`;

const GL_STORE = (color) => `#version 300 es
precision highp float;
precision highp int;
uniform highp sampler2D first;
uniform ivec3 corner;
uniform int z;
out vec4 result;
float channel(int index, int voxel) {
  int element = index / 4 * ${PADDED ** 3} + voxel;
  return texelFetch(first, ivec2(element % ${ROW}, element / ${ROW}), 0)[index % 4];
}
void main() {
  ivec2 p = ivec2(gl_FragCoord.xy) - corner.xy;
  int voxel = (p.x * ${PADDED} + p.y) * ${PADDED} + z;
  result = vec4(${color.map((c) => `channel(${c}, voxel)`).join(", ")}, 1.0);
}`;

class GlLattice extends Bricks {
  glsl = GL_LATTICE_LOOK_UP;

  constructor(gl, model) {
    super(model);
    if (!gl.getExtension("EXT_color_buffer_float"))
      throw new Error(`${model.name}: a model of the lattice family needs WebGPU, or WebGL 2 with`
                      + " textures of floats to draw to, which this browser does not offer");
    Object.assign(this, { gl, programs: {}, tensors: {} });
    const { lattice } = model;
    for (const { entry, tensor, elements } of lattice.passes) {
      this.programs[entry] ??= this.program(entry.replace(/^conv3d_\d+$/, "conv3d"));
      this.tensors[tensor] = this.texture(gl.RGBA32F, elements);
    }
    this.store = glProgram(gl, GL_WHOLE, GL_STORE(lattice.color));
    this.weights = this.texture(gl.RGBA32UI, this.words.length / 4);
    this.slotTable = this.texture(gl.R32UI, MAX_GRID ** 3, TABLE_ROW);
    this.atlas = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_3D, this.atlas);
    gl.texStorage3D(gl.TEXTURE_3D, 1, gl.RGBA8, ...ATLAS.map((bricks) => PADDED * bricks));
    gl.texParameteri(gl.TEXTURE_3D, gl.TEXTURE_MIN_FILTER, gl.LINEAR);
    this.uniforms = gl.createBuffer();
    this.target = gl.createFramebuffer();
  }

  destroy() {
    const { gl } = this;
    for (const program of [...Object.values(this.programs), this.store]) gl.deleteProgram(program);
    for (const texture of [...Object.values(this.tensors), this.weights, this.slotTable, this.atlas])
      gl.deleteTexture(texture);
    gl.deleteBuffer(this.uniforms);
    gl.deleteFramebuffer(this.target);
  }

  // The program of an operation. Sources are in texture units 0 and 1, weights in 2.
  program(operation) {
    const { gl } = this, defined = `#define ENTRY ${operation}\n#define ROW ${ROW}\n`;
    const program = glProgram(gl, GL_WHOLE, `#version 300 es\n${defined}${LATTICE_FRAGMENTS}`);
    gl.uniformBlockBinding(program, gl.getUniformBlockIndex(program, "Pass"), 0);
    ["first", "second", "weights"].forEach((name, unit) =>
      gl.uniform1i(gl.getUniformLocation(program, name), unit));
    return program;
  }

  texture(format, elements, row = ROW) {
    const { gl } = this, texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
    gl.texStorage2D(gl.TEXTURE_2D, 1, format, row, Math.ceil(elements / row));
    return texture;
  }

  // Writes whole rows of a texture of integers.
  fill(texture, format, values, row) {
    const { gl } = this, padded = new Uint32Array(Math.ceil(values.length / row) * row);
    padded.set(values);
    const width = format === gl.RED_INTEGER ? row : row / 4;
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, width, padded.length / row, format, gl.UNSIGNED_INT,
                     padded);
  }

  setSeed(seed) {
    super.setSeed(seed);
    this.fill(this.weights, this.gl.RGBA_INTEGER, this.words, 4 * ROW);
  }

  write() { this.fill(this.slotTable, this.gl.RED_INTEGER, this.table(), TABLE_ROW); }

  use(program) {
    const { gl } = this;
    gl.activeTexture(gl.TEXTURE1);
    gl.bindTexture(gl.TEXTURE_2D, this.slotTable);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_3D, this.atlas);
    gl.uniform1i(gl.getUniformLocation(program, "atlas"), 0);
    gl.uniform1i(gl.getUniformLocation(program, "slots"), 1);
    gl.uniform4i(gl.getUniformLocation(program, "grid"), ...this.offset, this.count);
  }

  missing({ framebuffer, width, height }) {
    const { gl } = this, found = new Set(), marks = new Uint32Array(4 * width * height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
    gl.readBuffer(gl.COLOR_ATTACHMENT1);
    gl.readPixels(0, 0, width, height, gl.RGBA_INTEGER, gl.UNSIGNED_INT, marks);
    for (let i = 0; i < marks.length; i += 4) if (marks[i]) found.add(marks[i] - 1);
    return [...found];
  }

  compute(brick) {
    const { gl, model: { lattice } } = this, corner = this.cornerFor(brick);
    this.setBrick(brick);
    gl.bindBuffer(gl.UNIFORM_BUFFER, this.uniforms);
    gl.bufferData(gl.UNIFORM_BUFFER, this.numbers, gl.DYNAMIC_DRAW);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.target);
    gl.disable(gl.DEPTH_TEST);
    gl.disable(gl.SCISSOR_TEST);
    lattice.passes.forEach(({ entry, tensor, sources, elements }, i) => {
      gl.useProgram(this.programs[entry]);
      [...sources.map((source) => this.tensors[source]), this.weights].forEach((texture, j) => {
        gl.activeTexture(texture === this.weights ? gl.TEXTURE2 : gl.TEXTURE0 + j);
        gl.bindTexture(gl.TEXTURE_2D, texture);
      });
      gl.bindBufferRange(gl.UNIFORM_BUFFER, 0, this.uniforms, UNIFORM_PITCH * i, UNIFORM_PITCH);
      gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D,
                              this.tensors[tensor], 0);
      gl.viewport(0, 0, ROW, Math.ceil(elements / ROW));
      gl.drawArrays(gl.TRIANGLES, 0, 3);
    });
    this.keep(corner);
  }

  // Copies the last tensor into the atlas, plane by plane.
  keep(corner) {
    const { gl, store } = this, plane = gl.getUniformLocation(store, "z");
    gl.useProgram(store);
    gl.activeTexture(gl.TEXTURE0);
    gl.bindTexture(gl.TEXTURE_2D, this.tensors[this.model.lattice.output]);
    gl.uniform3i(gl.getUniformLocation(store, "corner"), ...corner);
    gl.viewport(corner[0], corner[1], PADDED, PADDED);
    for (let z = 0; z < PADDED; ++z) {
      gl.framebufferTextureLayer(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, this.atlas, 0, corner[2] + z);
      gl.uniform1i(plane, z);
      gl.drawArrays(gl.TRIANGLES, 0, 3);
    }
  }

  // Waits for the work: a read does.
  finished() {
    const { gl } = this;
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
    return new Promise((done) => setTimeout(done));
  }
}
