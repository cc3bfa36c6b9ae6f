// The functions of Highway's library that the engine calls. Debian builds the library for its own
// processors only; the headers serve WebAssembly, where one target is known at compile time.
#include <hwy/aligned_allocator.h>
#include <hwy/highway.h>
#include <hwy/targets.h>

#include <cstdlib>

namespace hwy {

void* AllocateAlignedBytes(std::size_t size, AllocPtr, void*) {
  return std::aligned_alloc(HWY_ALIGNMENT,
                            (size + HWY_ALIGNMENT - 1) / HWY_ALIGNMENT * HWY_ALIGNMENT);
}

void FreeAlignedBytes(const void* memory, FreePtr, void*) { std::free(const_cast<void*>(memory)); }

std::int64_t SupportedTargets() { return HWY_STATIC_TARGET; }

void DisableTargets(std::int64_t) {}

ChosenTarget& GetChosenTarget() {
  static ChosenTarget target;
  return target;
}

}  // namespace hwy
