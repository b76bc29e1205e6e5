// The pixels of one tile, row by row, in cells of kLanes columns.
#pragma once
#include "lanes.h"
#include "types.h"

namespace dd::DD_ISA {

constexpr int kStrips = kTile / kLanes, kCells = kStrips * kTile;
// A set of cells, one bit for each: cell = row * kStrips + strip.
using Cells = uint64_t;
constexpr Cells kEachRow = kStrips == 1 ? 0xffff : kStrips == 2 ? 0x55555555 : 0x1111111111111111;
static inline Cells first_cells(int count) { return count < 64 ? (Cells(1) << count) - 1 : ~Cells(0); }

// The cells of the tile that a splat can reach.
static inline Cells reached_cells(const Splat& s, float left, float top) {
  using I4 = int32_t __attribute__((vector_size(16)));
  // Pixel centres lie at +0.5: the first column at or right of u - reach_x is ceil(u - reach_x - left - 0.5).
  const V4 bounds = {s.u - left - s.reach_x + 0.4999f, s.u - left + s.reach_x + 0.5f,
                     s.v - top - s.reach_y + 0.4999f, s.v - top + s.reach_y + 0.5f};
  const V4 low = bounds > 0.0f ? bounds : V4{}, side = V4{} + float(kTile);
  const I4 within = __builtin_convertvector(low < side ? low : side, I4);
  const Cells rows = first_cells(within[3] * kStrips) & ~first_cells(within[2] * kStrips);
  const Cells strips = first_cells((within[1] + kLanes - 1) / kLanes) & ~first_cells(within[0] / kLanes);
  return rows & strips * kEachRow;
}

// Some entries of a tile, looked at ahead of time: what follows does not wait for memory, and knows its cells at once.
struct Batch {
  static constexpr int kSize = 32;
  const Splat* splats[kSize];
  Cells cells[kSize];

  // Entries [first, last), and calls for the memory of those in [next, next_end).
  void look(const TileTask& task, int first, int last, int next, int next_end) {
    const float left = float(task.tile_x * kTile), top = float(task.tile_y * kTile);
    for (int i = next; i < next_end; i++) __builtin_prefetch(&task.splats[task.entries[i]]);
    for (int i = first; i < last; i++) {
      const Splat& s = task.splats[task.entries[i]];
      splats[i - first] = &s;
      cells[i - first] = reached_cells(s, left, top);
    }
  }
};

// e (see Splat) and the logarithm (base 2) of alpha in the cells of a tile, with all that rows or columns share.
class Form {
 public:
  Form(const Splat& s, float left, float top) : along_(broadcast(s.along)) {
    for (int strip = 0; strip < kStrips; strip++) {
      const V centre = iota() + (0.5f + float(strip * kLanes));
      const V dy = centre + (top - s.v);
      part_[strip] = s.conic_xx * (centre + (left - s.u));
      store(dy_ + strip * kLanes, dy);
      store(slant_ + strip * kLanes, s.conic_xy * dy);
      store(rest_ + strip * kLanes, (s.across * dy) * dy + s.log2_opacity);
    }
  }
  V dy(int cell) const { return broadcast(dy_[cell / kStrips]); }
  V e(int cell) const { return part_[cell % kStrips] + broadcast(slant_[cell / kStrips]); }
  V power(int cell, V e) const { return (along_ * e) * e + broadcast(rest_[cell / kStrips]); }

 private:
  V part_[kStrips], along_;
  alignas(64) float dy_[kTile], slant_[kTile], rest_[kTile];
};

}  // namespace dd::DD_ISA
