// The steps of lattice.wgsl as fragment shaders of WebGL 2. Tensors, weights and the numbers of a
// pass are the same. A texture holds a tensor in rows of ROW elements, each a fragment. ENTRY is the
// operation.
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp usampler2D;

struct Source { ivec3 size; int channels; ivec3 shift; int groups; };
layout(std140) uniform Pass {
  ivec3 size;
  int channels;
  ivec3 lo;
  int weights;
  Source sources[2];
  int groups;
  int kernel;
  float slope;
} pass;
uniform usampler2D weights;
uniform sampler2D first, second;
out vec4 result;

ivec3 voxel;
int group;

ivec2 texel(int index) { return ivec2(index % ROW, index / ROW); }
int element(ivec3 size, int group, ivec3 at) {
  return ((group * size.x + at.x) * size.y + at.y) * size.z + at.z;
}
vec4 of_first(int group, ivec3 at) {
  return texelFetch(first, texel(element(pass.sources[0].size, group, at)), 0);
}
vec4 of_second(int group, ivec3 at) {
  return texelFetch(second, texel(element(pass.sources[1].size, group, at)), 0);
}
// The element of the first source with the same voxel.
vec4 same(int group) { return of_first(group, voxel + pass.sources[0].shift); }
uvec4 words(int index) { return texelFetch(weights, texel(pass.weights + index), 0); }
vec4 weight(int index) { return uintBitsToFloat(words(index)); }
vec4 rectified(vec4 x) { return max(x, vec4(0.0)) + pass.slope * min(x, vec4(0.0)); }
// Channels of the element, which the last group may not fill.
int width() { return min(4, pass.channels - 4 * group); }

uint word(int channel) {
  uvec3 p = uvec3(pass.lo + voxel);
  uvec4 key = words(channel);
  return noise_bits(p.x, p.y, p.z, key.x, key.y, key.z, key.w);
}
vec4 noise_uniform() {
  vec4 values = vec4(0.0);
  for (int c = 0; c < width(); c++)
    values[c] = float(word(4 * group + c) >> 8u) * 5.9604644775390625e-8;
  return values;
}
vec4 noise_normal() {
  vec4 values = vec4(0.0);
  for (int c = 0; c < width(); c++) values[c] = noise_deviate(word(4 * group + c));
  return values;
}
vec4 periodic() {
  uvec3 p = uvec3(pass.lo + voxel);
  vec4 values = vec4(0.0);
  for (int c = 0; c < width(); c++) {
    uvec4 wave = words(4 * group + c);
    uint angle = wave.x * p.x + wave.y * p.y + wave.z * p.z + wave.w;
    bool is_beyond = angle - 0x40000000u < 0x80000000u;
    float x = float(int(is_beyond ? 0x80000000u - angle : angle)) * 1.4629180792671596e-9;
    float s = x * x;
    values[c] = x * (1.0 + s * (-0.16666666667 + s * (8.3333333333e-3 + s * (-1.9841269841e-4
      + s * (2.7557319224e-6 - s * 2.5052108385e-8)))));
  }
  return values;
}

vec4 product(int w, vec4 x) {
  return mat4(weight(w), weight(w + 1), weight(w + 2), weight(w + 3)) * x;
}
vec4 conv3d() {
  int k = pass.kernel, w = group * (1 + 4 * pass.sources[0].groups * k * k * k);
  vec4 sum = weight(w++);
  for (int q = 0; q < pass.sources[0].groups; q++)
    for (int x = 0; x < k; x++)
      for (int y = 0; y < k; y++)
        for (int z = 0; z < k; z++, w += 4)
          sum += product(w, of_first(q, voxel + pass.sources[0].shift + ivec3(x, y, z)));
  return rectified(sum);
}
vec4 conv_transpose3d() {
  int k = pass.kernel, w = group * (1 + 4 * pass.sources[0].groups * k * k * k);
  vec4 sum = weight(w++);
  ivec3 to = voxel + pass.sources[0].shift;
  for (int q = 0; q < pass.sources[0].groups; q++)
    for (int x = to.x & 1; x < k; x += 2)
      for (int y = to.y & 1; y < k; y += 2)
        for (int z = to.z & 1; z < k; z += 2)
          sum += product(w + 4 * (((q * k + x) * k + y) * k + z),
                         of_first(q, (to - ivec3(x, y, z)) / 2));
  return rectified(sum);
}

vec4 upsample() { return of_first(group, (voxel + pass.sources[0].shift) >> 1); }
vec4 concat() {
  vec4 values = vec4(0.0);
  for (int c = 0; c < width(); c++) {
    int channel = 4 * group + c, other = channel - pass.sources[0].channels;
    if (other < 0) values[c] = same(channel / 4)[channel % 4];
    else values[c] = of_second(other / 4, voxel + pass.sources[1].shift)[other % 4];
  }
  return values;
}

vec4 affine() { return weight(2 * group) * same(group) + weight(2 * group + 1); }
vec4 leaky_relu() { return rectified(same(group)); }
vec4 tanh_() { return 1.0 - 2.0 / (exp(2.0 * clamp(same(group), -20.0, 20.0)) + 1.0); }
vec4 sigmoid() { return 1.0 / (1.0 + exp(-clamp(same(group), -80.0, 80.0))); }
vec4 softmax() {
  float largest = same(0).x, sum = 0.0;
  for (int c = 1; c < pass.channels; c++) largest = max(largest, same(c / 4)[c % 4]);
  for (int c = 0; c < pass.channels; c++) sum += exp(same(c / 4)[c % 4] - largest);
  return exp(min(same(group) - largest, vec4(0.0))) / sum;
}

void main() {
  int index = int(gl_FragCoord.y) * ROW + int(gl_FragCoord.x);
  voxel.z = index % pass.size.z;
  index /= pass.size.z;
  voxel.y = index % pass.size.y;
  index /= pass.size.y;
  voxel.x = index % pass.size.x;
  group = index / pass.size.x;
  if (group >= pass.groups) discard;  // the end of the last row
  result = ENTRY();
}
