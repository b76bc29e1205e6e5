// Which splats each tile must composite, in depth order.
#pragma once
#include <vector>

#include "buffer.h"
#include "types.h"

namespace dd {

struct TileLists {
  Buffer<uint32_t> tile_begin;  // tiles + 1: ranges of entries
  Buffer<uint32_t> entries;     // indices into the splats
  Buffer<uint32_t> slot_begin;  // splats + 1: ranges of slots
  Buffer<uint32_t> slots;       // places in `entries` that belong to a splat
  int64_t n_entries = 0;
};

class TileBinner {
 public:
  // `splats` are in depth order; so is each tile's list.
  void bin(const View& view, const Splat* splats, int64_t n, TileLists& out);

 private:
  std::vector<Buffer<uint32_t>> tiles_of_chunk_;  // tile of each slot, chunk by chunk
  Buffer<uint32_t> cursor_;                       // chunk x tile
  Buffer<uint32_t> slot_base_;                    // first slot of a chunk
};

// Sorts keys ascending, equal keys keep their order (by the upper 32 bits alone); tmp is scratch of the same size.
void sort_by_depth(uint64_t* keys, uint64_t* tmp, int64_t n);

}  // namespace dd
