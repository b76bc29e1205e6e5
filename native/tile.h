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

// Logarithm (base 2) of the alpha of a row of lanes: along x the base and slope are those of the row.
struct RowPower {
  V dx, base;
  float b, c;
  RowPower(const Splat& s, V dx_) : dx(dx_), base(s.a * dx_ * dx_ + s.log2_opacity), b(s.b), c(s.c) {}
  V at(float dy) const { return dx * (b * dy) + (base + c * dy * dy); }
};

}  // namespace dd::DD_ISA
