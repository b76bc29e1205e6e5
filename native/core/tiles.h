// Which splats each tile must composite, in depth order.
#pragma once
#include <vector>

#include "buffer.h"
#include "kernels/types.h"

namespace dd {

struct TileLists {
  Buffer<uint32_t> tile_begin;  // tiles + 1: ranges of entries
  Buffer<uint32_t> entries;     // indices into the splats
  Buffer<uint32_t> slot_begin;  // splats + 1: ranges of slots
  Buffer<Slot> slots;           // where each splat stands in the lists; only if wanted
  int64_t n_entries = 0;
};

class TileBinner {
 public:
  // `splats` are in depth order; so is each tile's list. Of every Gaussian that reaches a tile, sets its place among the
  // splats in `rank` and 1 in `visible`; the others are left alone.
  void bin(const View& view, const Splat* splats, int64_t n, bool want_slots, TileLists& out, uint32_t* rank,
           uint8_t* visible);

 private:
  std::vector<Buffer<Slot>> covered_;  // tile and splat of each slot, chunk by chunk
  Buffer<uint32_t> cursor_;            // chunk x tile
};

// Sorts keys ascending by the upper 32 bits; equal ones keep their order. tmp is scratch of the same size.
void sort_by_depth(uint64_t* keys, uint64_t* tmp, int64_t n);

}  // namespace dd
