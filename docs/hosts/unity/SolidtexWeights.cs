using System.IO;
using UnityEngine;

// Gives the weights to every shader that includes stone.hlsl.
public class SolidtexWeights : MonoBehaviour
{
    const int Width = 128; // texels, as solidtex-export-shader prints
    Texture2D weights;

    void OnEnable()
    {
        byte[] data = File.ReadAllBytes(Path.Combine(Application.streamingAssetsPath, "stone.weights.bin"));
        weights = new Texture2D(Width, data.Length / 8 / Width, TextureFormat.RGBAHalf, false, true);
        weights.LoadRawTextureData(data);
        weights.Apply();
        Shader.SetGlobalTexture("solidtex_stone_weights", weights);
    }

    void OnDisable() => Destroy(weights);
}
