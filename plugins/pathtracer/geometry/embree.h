// Hides the differences between Embree 3 (Debian 12) and Embree 4 (Debian 13).
#pragma once

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

namespace solidtex::pathtracer {

inline void embree_intersect(RTCScene scene, RTCRayHit& query) {
#if RTC_VERSION_MAJOR >= 4
  rtcIntersect1(scene, &query);
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(scene, &context, &query);
#endif
}

// Sets ray.tfar to minus infinity if anything is hit.
inline void embree_occluded(RTCScene scene, RTCRay& ray) {
#if RTC_VERSION_MAJOR >= 4
  rtcOccluded1(scene, &ray);
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded1(scene, &context, &ray);
#endif
}

// Embree's packet types and functions by width.
template <int kWidth>
struct EmbreePacket;
template <>
struct EmbreePacket<4> {
  using Ray = RTCRay4;
  using RayHit = RTCRayHit4;
  static constexpr auto* intersect = rtcIntersect4;
  static constexpr auto* occluded = rtcOccluded4;
};
template <>
struct EmbreePacket<8> {
  using Ray = RTCRay8;
  using RayHit = RTCRayHit8;
  static constexpr auto* intersect = rtcIntersect8;
  static constexpr auto* occluded = rtcOccluded8;
};
template <>
struct EmbreePacket<16> {
  using Ray = RTCRay16;
  using RayHit = RTCRayHit16;
  static constexpr auto* intersect = rtcIntersect16;
  static constexpr auto* occluded = rtcOccluded16;
};

// valid[i]: -1 for rays to trace, 0 for others. `coherent`: the rays are similar.
template <int kWidth>
void embree_intersect(RTCScene scene, const int* valid, bool coherent,
                      typename EmbreePacket<kWidth>::RayHit& query) {
#if RTC_VERSION_MAJOR >= 4
  RTCIntersectArguments arguments;
  rtcInitIntersectArguments(&arguments);
  if (coherent) arguments.flags = RTC_RAY_QUERY_FLAG_COHERENT;
  EmbreePacket<kWidth>::intersect(valid, scene, &query, &arguments);
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  if (coherent) context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  EmbreePacket<kWidth>::intersect(valid, scene, &context, &query);
#endif
}

// Never coherent: Embree 3.13 then hangs on instances.
template <int kWidth>
void embree_occluded(RTCScene scene, const int* valid, typename EmbreePacket<kWidth>::Ray& query) {
#if RTC_VERSION_MAJOR >= 4
  EmbreePacket<kWidth>::occluded(valid, scene, &query, nullptr);
#else
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  EmbreePacket<kWidth>::occluded(valid, scene, &context, &query);
#endif
}

}  // namespace solidtex::pathtracer
