// Checks an encoder before ONNX Runtime reads it.
#pragma once

#include <cstddef>
#include <span>
#include <string>

namespace solidtex::engine {

// Throws Error unless `bytes` are an ONNX file that holds one plain graph: known operators of ONNX
// itself, no subgraphs, no functions, no weights in other files. `where` begins the message.
void check_onnx(std::span<const std::byte> bytes, const std::string& where);

}  // namespace solidtex::engine
