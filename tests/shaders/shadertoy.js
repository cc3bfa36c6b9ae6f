// What Shadertoy does with tabs: ([buffers A to D, image], size, time) to the picture's address.
// The page has glProgram() of webgl.js.
([buffers, image, [width, height], time]) => {
  const canvas = document.createElement("canvas");
  Object.assign(canvas, { width, height });
  const gl = canvas.getContext("webgl2", { preserveDrawingBuffer: true });
  gl.getExtension("EXT_color_buffer_float");
  const head = `#version 300 es
precision highp float; precision highp int; precision highp sampler2D;
uniform vec3 iResolution; uniform float iTime; uniform sampler2D iChannel0;
out vec4 shown;
`;
  const corners = "vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0";
  const vertex = `#version 300 es\nvoid main() { gl_Position = vec4(${corners}, 0, 1); }`;
  const target = () => {
    const texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA32F, width, height);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
    return texture;
  };
  const draw = (tab, input, output) => {
    const framebuffer = output && gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
    if (output)
      gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, output, 0);
    const main = "void main() { mainImage(shown, gl_FragCoord.xy); }";
    const program = glProgram(gl, vertex, `${head}${tab}\n${main}`);
    const place = (name) => gl.getUniformLocation(program, name);
    gl.bindTexture(gl.TEXTURE_2D, input);
    gl.uniform3f(place("iResolution"), width, height, 1);
    gl.uniform1f(place("iTime"), time);
    gl.viewport(0, 0, width, height);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    return output;
  };
  const weights = buffers.reduce((input, tab) => draw(tab, input, target()), target());
  draw(image, weights, null);
  return canvas.toDataURL();
}
