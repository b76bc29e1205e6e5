// The pixels of one tile as strips of kLanes columns: strip-major, then rows, then lanes.
#pragma once
#include "lanes.h"
#include "types.h"

namespace dd::DD_ISA {

constexpr int kStrips = kTile / kLanes;
static inline int at(int strip, int row) { return (strip * kTile + row) * kLanes; }

// Rows and strips of the tile that a splat can reach; empty if first > last.
struct Span {
  int first_row, last_row, first_strip, last_strip;
};
static inline int clamped(float x, int low, int high) {
  return int(x < float(low) ? float(low) : x > float(high) ? float(high) : x);
}
static inline Span span(const Splat& s, float left, float top) {
  // Pixel centres lie at +0.5: the first row at or above v - reach_y is ceil(v - reach_y - top - 0.5).
  const float v = s.v - top - 0.5f, u = s.u - left - 0.5f;
  Span out;
  out.first_row = clamped(v - s.reach_y + 0.9999f, 0, kTile);
  out.last_row = clamped(v + s.reach_y + 1.0f, 0, kTile) - 1;
  out.first_strip = clamped(u - s.reach_x + 0.9999f, 0, kTile) / kLanes;
  out.last_strip = (clamped(u + s.reach_x + 1.0f, 0, kTile) - 1 + kLanes) / kLanes - 1;
  return out;
}

// e (see Splat) and the logarithm (base 2) of alpha along a row of lanes.
struct Strip {
  V part;  // of e that all rows share
  float conic_xy, along, across, log2_opacity;
  Strip(const Splat& s, float left)
      : part(s.conic_xx * (iota() + (left + 0.5f - s.u))), conic_xy(s.conic_xy), along(s.along), across(s.across),
        log2_opacity(s.log2_opacity) {}
  V e(float dy) const { return part + conic_xy * dy; }
  V power(V e, float dy) const { return (along * e) * e + (log2_opacity + across * dy * dy); }
};

}  // namespace dd::DD_ISA
