// Custom Function node of Shader Graph: File mode, function Solidtex.
#include "stone.hlsl"

void Solidtex_float(float3 Position, float TexelsPerUnit, out float3 Color)
{
    float3 texel = TexelsPerUnit * Position;
    float footprint = 0.5 * max(length(ddx(texel)), length(ddy(texel)));
    // Lighting works in linear light.
    Color = pow(max(solidtex_stone(texel, footprint), 0.0), 2.2);
}
