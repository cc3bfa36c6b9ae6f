// Behind the exported functions: a ball, turning.
void mainImage(out vec4 color, in vec2 pixel) {
  vec2 at = (2.0 * pixel - iResolution.xy) / iResolution.y;
  float square = 1.0 - dot(at, at);
  color = vec4(0.85);
  if (square < 0.0) return;
  vec3 facing = vec3(at, sqrt(square));
  float c = cos(0.3 * iTime), s = sin(0.3 * iTime);
  vec3 texel = 150.0 * vec3(c * facing.x - s * facing.z, facing.y, s * facing.x + c * facing.z);
  vec3 albedo = pow(max(solidtex_stone(texel, 150.0 / iResolution.y), 0.0), vec3(2.2));
  float light = 0.3 + 0.9 * max(dot(facing, normalize(vec3(1, 2, 3))), 0.0);
  color = vec4(pow(light * albedo, vec3(1.0 / 2.2)), 1.0);
}
