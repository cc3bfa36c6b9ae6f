// Tensors have four channels in an element: [channel / 4][x][y][z]. Channels that fill up the last
// element are read with weights of 0. Boxes and shifts: solidtex_export/export/shader/lattice.py.

struct Source { size: vec3<i32>, channels: i32, shift: vec3<i32>, groups: i32 }
struct Step {
  size: vec3<i32>,  // voxels of the result
  channels: i32,
  lo: vec3<i32>,  // first voxel of noise, modulo 2^32
  weights: i32,  // its first element of `weights`
  sources: array<Source, 2>,
  groups: i32,  // of four channels
  kernel: i32,
  slope: f32,  // of what is negative, 1 without a rectifier
}
@group(0) @binding(0) var<uniform> step: Step;
@group(0) @binding(1) var<storage, read> weights: array<vec4<u32>>;
@group(0) @binding(2) var<storage, read> first: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read> second: array<vec4<f32>>;
@group(0) @binding(4) var<storage, read_write> result: array<vec4<f32>>;

struct Place { voxel: vec3<i32>, group: i32 }

// Each invocation computes `run` voxels along z of one group of channels.
fn place(id: vec3<u32>, run: i32) -> Place {
  let i = vec3<i32>(id);
  return Place(vec3<i32>(i.z % step.size.x, i.y, run * i.x), i.z / step.size.x);
}
fn is_inside(at: Place) -> bool {
  return at.voxel.y < step.size.y && at.voxel.z < step.size.z && at.group < step.groups;
}
fn element(size: vec3<i32>, group: i32, voxel: vec3<i32>) -> i32 {
  return ((group * size.x + voxel.x) * size.y + voxel.y) * size.z + voxel.z;
}
fn element_of(source: i32, group: i32, voxel: vec3<i32>) -> i32 {
  let s = step.sources[source];
  return element(s.size, group, voxel + s.shift);
}
fn put(at: Place, value: vec4<f32>) {
  result[element(step.size, at.group, at.voxel)] = value;
}
fn weight(index: i32) -> vec4<f32> {
  return bitcast<vec4<f32>>(weights[step.weights + index]);
}
fn rectified(x: vec4<f32>, slope: f32) -> vec4<f32> {
  return max(x, vec4<f32>(0.0)) + slope * min(x, vec4<f32>(0.0));
}

// noise

fn word(at: Place, channel: i32) -> u32 {
  let p = bitcast<vec3<u32>>(step.lo + at.voxel);
  let key = weights[step.weights + channel];
  return noise_bits(p.x, p.y, p.z, key.x, key.y, key.z, key.w);
}
@compute @workgroup_size(8, 8) fn noise_uniform(@builtin(global_invocation_id) id: vec3<u32>) {
  let at = place(id, 1);
  if (!is_inside(at)) { return; }
  var values = vec4<f32>(0.0);
  for (var c = 0; c < min(4, step.channels - 4 * at.group); c++) {
    values[c] = f32(word(at, 4 * at.group + c) >> 8u) * 5.9604644775390625e-8;
  }
  put(at, values);
}
@compute @workgroup_size(8, 8) fn noise_normal(@builtin(global_invocation_id) id: vec3<u32>) {
  let at = place(id, 1);
  if (!is_inside(at)) { return; }
  var values = vec4<f32>(0.0);
  for (var c = 0; c < min(4, step.channels - 4 * at.group); c++) {
    values[c] = noise_deviate(word(at, 4 * at.group + c));
  }
  put(at, values);
}

// periodic: the sine of an angle in turns of 2^32, folded to a quarter, by its series

@compute @workgroup_size(8, 8) fn periodic(@builtin(global_invocation_id) id: vec3<u32>) {
  let at = place(id, 1);
  if (!is_inside(at)) { return; }
  let p = bitcast<vec3<u32>>(step.lo + at.voxel);
  var values = vec4<f32>(0.0);
  for (var c = 0; c < min(4, step.channels - 4 * at.group); c++) {
    let wave = weights[step.weights + 4 * at.group + c];
    let angle = wave.x * p.x + wave.y * p.y + wave.z * p.z + wave.w;
    let is_beyond = angle - 0x40000000u < 0x80000000u;
    let folded = bitcast<i32>(select(angle, 0x80000000u - angle, is_beyond));
    let x = f32(folded) * 1.4629180792671596e-9;
    let s = x * x;
    values[c] = x * (1.0 + s * (-0.16666666667 + s * (8.3333333333e-3 + s * (-1.9841269841e-4
      + s * (2.7557319224e-6 - s * 2.5052108385e-8)))));
  }
  put(at, values);
}

// conv_transpose3d: out[o] = b + sum of w[t] in[i] over o = 2i + t - padding

@compute @workgroup_size(8, 8) fn conv_transpose3d(@builtin(global_invocation_id) id: vec3<u32>) {
  let at = place(id, 1);
  if (!is_inside(at)) { return; }
  let source = step.sources[0];
  let k = step.kernel;
  let start = at.group * (1 + 4 * source.groups * k * k * k);
  var sum = weight(start);
  let to = at.voxel + source.shift;
  for (var q = 0; q < source.groups; q++) {
    for (var x = to.x & 1; x < k; x += 2) {
      for (var y = to.y & 1; y < k; y += 2) {
        for (var z = to.z & 1; z < k; z += 2) {
          let origin = (to - vec3<i32>(x, y, z)) / 2;
          let value = first[element(source.size, q, origin)];
          let w = start + 1 + 4 * (((q * k + x) * k + y) * k + z);
          sum += value.x * weight(w) + value.y * weight(w + 1) + value.z * weight(w + 2)
            + value.w * weight(w + 3);
        }
      }
    }
  }
  put(at, rectified(sum, step.slope));
}

// upsample, concat

@compute @workgroup_size(8, 8) fn upsample(@builtin(global_invocation_id) id: vec3<u32>) {
  let at = place(id, 1);
  if (!is_inside(at)) { return; }
  let source = step.sources[0];
  let origin = (at.voxel + source.shift) >> vec3<u32>(1u);
  put(at, first[element(source.size, at.group, origin)]);
}
@compute @workgroup_size(8, 8) fn concat(@builtin(global_invocation_id) id: vec3<u32>) {
  let at = place(id, 1);
  if (!is_inside(at)) { return; }
  var values = vec4<f32>(0.0);
  for (var c = 0; c < min(4, step.channels - 4 * at.group); c++) {
    let channel = 4 * at.group + c;
    let other = channel - step.sources[0].channels;
    if (other < 0) {
      values[c] = first[element_of(0, channel / 4, at.voxel)][channel % 4];
    } else {
      values[c] = second[element_of(1, other / 4, at.voxel)][other % 4];
    }
  }
  put(at, values);
}

// Operations on each value

@compute @workgroup_size(8, 8) fn affine(@builtin(global_invocation_id) id: vec3<u32>) {
  let at = place(id, 1);
  if (!is_inside(at)) { return; }
  let x = first[element_of(0, at.group, at.voxel)];
  put(at, weight(2 * at.group) * x + weight(2 * at.group + 1));
}
@compute @workgroup_size(8, 8) fn leaky_relu(@builtin(global_invocation_id) id: vec3<u32>) {
  let at = place(id, 1);
  if (!is_inside(at)) { return; }
  put(at, rectified(first[element_of(0, at.group, at.voxel)], step.slope));
}
@compute @workgroup_size(8, 8) fn tanh_(@builtin(global_invocation_id) id: vec3<u32>) {
  let at = place(id, 1);
  if (!is_inside(at)) { return; }
  let x = clamp(first[element_of(0, at.group, at.voxel)], vec4<f32>(-20.0), vec4<f32>(20.0));
  put(at, 1.0 - 2.0 / (exp(2.0 * x) + 1.0));
}
@compute @workgroup_size(8, 8) fn sigmoid(@builtin(global_invocation_id) id: vec3<u32>) {
  let at = place(id, 1);
  if (!is_inside(at)) { return; }
  let x = clamp(first[element_of(0, at.group, at.voxel)], vec4<f32>(-80.0), vec4<f32>(80.0));
  put(at, 1.0 / (1.0 + exp(-x)));
}
@compute @workgroup_size(8, 8) fn softmax(@builtin(global_invocation_id) id: vec3<u32>) {
  let at = place(id, 1);
  if (!is_inside(at)) { return; }
  var largest = first[element_of(0, 0, at.voxel)].x;
  for (var c = 1; c < step.channels; c++) {
    largest = max(largest, first[element_of(0, c / 4, at.voxel)][c % 4]);
  }
  var sum = 0.0;
  for (var c = 0; c < step.channels; c++) {
    sum += exp(first[element_of(0, c / 4, at.voxel)][c % 4] - largest);
  }
  let x = min(first[element_of(0, at.group, at.voxel)] - largest, vec4<f32>(0.0));
  put(at, exp(x) / sum);
}
