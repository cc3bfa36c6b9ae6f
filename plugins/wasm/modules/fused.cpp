// Fused multiply-adds of one number, in place of libc's. That of Emscripten 3.1.6 sets the rounding
// mode, which WebAssembly lacks, and so errs where a sum is halfway between two floats.
#include <bit>
#include <cmath>
#include <cstdint>

#ifdef SOLIDTEX_UNFUSED

extern "C" float fmaf(float x, float y, float z) { return x * y + z; }

extern "C" double fma(double x, double y, double z) { return x * y + z; }

#else

// The product is exact in double. The sum is rounded to odd there, so that rounding it to float
// gives what one rounding would. libc's fma of doubles is exact.
extern "C" float fmaf(float x, float y, float z) {
  const double product = double{x} * double{y}, addend = z, sum = product + addend;
  if (!std::isfinite(sum)) return static_cast<float>(sum);
  const double added = sum - product;
  const double error = (product - (sum - added)) + (addend - added);
  auto bits = std::bit_cast<std::uint64_t>(sum);
  if (error != 0 && (bits & 1) == 0) bits += (error > 0) == (sum > 0) ? 1 : -1;
  return static_cast<float>(std::bit_cast<double>(bits));
}

#endif
