// The solid in WebGL 2: triangles, and the exported function in the fragment shader.

const GL_VERTEX = `#version 300 es
uniform vec4 settings[8];
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
out vec3 at, facing;
void main() {
  at = position;
  facing = normal;
  gl_Position = mat4(settings[0], settings[1], settings[2], settings[3]) * vec4(position, 1.0);
}`;
const GL_FRAGMENT = `
uniform vec4 settings[8];
uniform ivec3 origin;
in vec3 at, facing;
layout(location = 0) out vec4 color;
layout(location = 1) out uint lacked;
void main() {
  vec3 eye = settings[4].xyz, p = at, n = normalize(facing);
  vec4 cut = settings[5];
  if (settings[7].y > 0.5) {
    float below = cut.w - dot(cut.xyz, p), height = dot(cut.xyz, eye) - cut.w;
    if (below < 0.0) discard;
    if (!gl_FrontFacing && height > 0.0) {  // the nearest face is a back: the ray enters where the solid is cut
      p = mix(eye, p, height / (height + below));
      n = cut.xyz;
    }
  }
  if (dot(n, eye - p) < 0.0) n = -n;
  float scale = settings[6].w;
  float footprint = 0.5 * scale * distance(eye, p) * settings[4].w * settings[7].z;
  vec3 albedo = solidtex_solid_at(origin, scale * p + settings[6].xyz, footprint);
  if (settings[7].x > 0.5) {
    float light = 0.3 + 0.9 * max(dot(n, normalize(vec3(1.0, 2.0, 3.0))), 0.0);
    albedo = pow(light * pow(max(albedo, 0.0), vec3(2.2)), vec3(1.0 / 2.2));
  }
  color = vec4(albedo, 1.0);
  lacked = missing;
}`;

// A program in use, of two sources.
function glProgram(gl, ...sources) {
  const program = gl.createProgram();
  [gl.VERTEX_SHADER, gl.FRAGMENT_SHADER].forEach((kind, i) => {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, sources[i]);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
    gl.deleteShader(shader);
  });
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS))
    throw new Error(`the shader cannot be linked: ${gl.getProgramInfoLog(program)}`);
  gl.useProgram(program);
  return program;
}

class GlSampler {
  constructor(gl, model) {
    Object.assign(this, { gl, model, glsl: model.glsl, texture: gl.createTexture() });
  }

  destroy() { this.gl.deleteTexture(this.texture); }

  setSeed(seed) {
    const { gl, model: { width } } = this, halves = seeded(this.model, seed);
    gl.bindTexture(gl.TEXTURE_2D, this.texture);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA16F, width, halves.length / 4 / width, 0, gl.RGBA,
                  gl.HALF_FLOAT, halves);
  }

  setPlace() {}
  use() { this.gl.bindTexture(this.gl.TEXTURE_2D, this.texture); }
  async refine() { return false; }
}

class WebGlView {
  static near = -1;  // of clip space

  static async create(canvas, onLost) {
    const gl = canvas.getContext("webgl2", { preserveDrawingBuffer: true, antialias: false });
    if (!gl) return null;
    canvas.addEventListener("webglcontextlost", () => onLost("the graphics context was lost"));
    return new WebGlView(gl);
  }

  constructor(gl) {
    this.gl = gl;
    this.name = "WebGL 2";
    this.buffers = [gl.createBuffer(), gl.createBuffer()];
    this.framebuffer = gl.createFramebuffer();
  }

  setMesh({ positions, normals }) {
    const { gl } = this;
    [positions, normals].forEach((values, i) => {
      gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers[i]);
      gl.bufferData(gl.ARRAY_BUFFER, values, gl.STATIC_DRAW);
      gl.enableVertexAttribArray(i);
      gl.vertexAttribPointer(i, 3, gl.FLOAT, false, 0, 0);
    });
    this.count = positions.length / 3;
  }

  async setModel(model) {
    const { gl } = this;
    this.material?.destroy();
    this.material = null;
    this.material = new (model.lattice ? GlLattice : GlSampler)(gl, model);
    gl.deleteProgram(this.program);
    this.program = glProgram(
      gl, GL_VERTEX, `#version 300 es\nhighp uint missing = 0u;\n${this.material.glsl}${GL_FRAGMENT}`);
  }

  setSeed(seed) { this.material.setSeed(seed); }
  setPlace(place, texels) { this.material.setPlace(place, texels); }
  refine(isCurrent) { return this.material.refine(this, isCurrent); }

  begin(width, height) {
    const { gl } = this;
    if (this.width !== width || this.height !== height) this.resize(width, height);
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.framebuffer);
    gl.disable(gl.SCISSOR_TEST);
    gl.clearBufferfv(gl.COLOR, 0, [0.86, 0.86, 0.86, 1]);
    gl.clearBufferuiv(gl.COLOR, 1, [0, 0, 0, 0]);
    gl.clearBufferfv(gl.DEPTH, 0, [1]);
  }

  // What is drawn to: colors, and bricks of a lattice that pixels lack.
  resize(width, height) {
    const { gl } = this;
    Object.assign(this, { width, height });
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.framebuffer);
    for (const renderbuffer of this.renderbuffers ?? []) gl.deleteRenderbuffer(renderbuffer);
    const parts = [[gl.COLOR_ATTACHMENT0, gl.RGBA8], [gl.COLOR_ATTACHMENT1, gl.R32UI],
                   [gl.DEPTH_ATTACHMENT, gl.DEPTH_COMPONENT24]];
    this.renderbuffers = parts.map(([attachment, format]) => {
      const renderbuffer = gl.createRenderbuffer();
      gl.bindRenderbuffer(gl.RENDERBUFFER, renderbuffer);
      gl.renderbufferStorage(gl.RENDERBUFFER, format, width, height);
      gl.framebufferRenderbuffer(gl.FRAMEBUFFER, attachment, gl.RENDERBUFFER, renderbuffer);
      return renderbuffer;
    });
    gl.drawBuffers([gl.COLOR_ATTACHMENT0, gl.COLOR_ATTACHMENT1]);
  }

  // Draws a part of the canvas and waits for it.
  async draw(settings, origin, [x, y, width, height]) {
    const { gl, program } = this;
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.framebuffer);
    gl.viewport(0, 0, this.width, this.height);
    gl.useProgram(program);
    this.material.use(program);
    gl.uniform4fv(gl.getUniformLocation(program, "settings"), settings);
    gl.uniform3iv(gl.getUniformLocation(program, "origin"), origin);
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.SCISSOR_TEST);
    gl.scissor(x, this.height - y - height, width, height);
    gl.drawArrays(gl.TRIANGLES, 0, this.count);
    gl.readBuffer(gl.COLOR_ATTACHMENT0);
    gl.readPixels(x, this.height - y - 1, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
  }

  // Shows the rows that are drawn, on all of the canvas.
  async show(rows) {
    const { gl, width, height } = this, { width: right, height: top } = gl.canvas;
    const bottom = Math.round(top * (height - rows) / height);
    gl.bindFramebuffer(gl.READ_FRAMEBUFFER, this.framebuffer);
    gl.bindFramebuffer(gl.DRAW_FRAMEBUFFER, null);
    gl.disable(gl.SCISSOR_TEST);
    gl.readBuffer(gl.COLOR_ATTACHMENT0);
    gl.blitFramebuffer(0, height - rows, width, height, 0, bottom, right, top, gl.COLOR_BUFFER_BIT,
                       width === right ? gl.NEAREST : gl.LINEAR);
  }
}
