// The pixels of one tile in cells: kLanes columns of one row.
#pragma once
#include "lanes.h"
#include "types.h"

namespace dd::DD_ISA {

constexpr int kStrips = kTile / kLanes, kCells = kStrips * kTile;
// A set of cells, one bit for each: cell = strip * kTile + row.
using Cells = uint64_t;
static inline int first_column(int cell) { return cell / kTile * kLanes; }
static inline int pixel_of(int cell) { return cell % kTile * kTile + first_column(cell); }
static inline int cell_of(int pixel) { return pixel % kTile / kLanes * kTile + pixel / kTile; }

// The cells of the tile that the ellipse alpha >= 1/255 of a splat meets.
static inline Cells reached_cells(const Splat& s, float left, float top) {
  const float inverse = 1.0f / s.reach_y, square = s.half_width * s.half_width;
  Cells cells = 0;
  for (int row = 0; row < kTile; row += kLanes) {
    // Of a row, the pixels within sqrt(room) of the middle.
    const V dy = iota() + (float(row) + 0.5f + top - s.v), share = dy * inverse;
    const V room = square * (1.0004f - share * share), middle = s.slope_x * dy + (s.u - left);
    for (int strip = 0; strip < kStrips; strip++) {
      const float first = float(strip * kLanes) + 0.499f, last = float(strip * kLanes + kLanes) - 0.499f;
      const V away = vmax(vmax(first - middle, middle - last), V{});
      cells |= Cells(bits(away * away <= room)) << (strip * kTile + row);
    }
  }
  return cells;
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
  V dy(int cell) const { return broadcast(dy_[cell % kTile]); }
  V e(int cell) const { return part_[cell / kTile] + broadcast(slant_[cell % kTile]); }
  V power(int cell, V e) const { return (along_ * e) * e + broadcast(rest_[cell % kTile]); }

 private:
  V part_[kStrips], along_;
  alignas(64) float dy_[kTile], slant_[kTile], rest_[kTile];
};

}  // namespace dd::DD_ISA
