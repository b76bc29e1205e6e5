#include "tiles.h"

#include <algorithm>
#include <cstring>
#include <stdexcept>

#include "threads.h"

namespace dd {
namespace {

constexpr int kMaxChunks = 64;

// Turns counts (chunk x tile) into the place of each chunk's first entry in each tile; returns the ranges of the tiles.
const uint32_t* begin_of_tiles(uint32_t* counts, int64_t chunks, int64_t tiles, TileLists& out) {
  uint32_t* begin = out.tile_begin.resize(tiles + 1);
  std::vector<uint32_t> next(tiles, 0);
  for (int64_t chunk = 0; chunk < chunks; chunk++)
    for (int64_t tile = 0; tile < tiles; tile++) next[tile] += counts[chunk * tiles + tile];
  uint32_t place = 0;
  for (int64_t tile = 0; tile < tiles; tile++) {
    begin[tile] = place;
    place += next[tile];
    next[tile] = begin[tile];
  }
  begin[tiles] = place;
  for (int64_t chunk = 0; chunk < chunks; chunk++)
    for (int64_t tile = 0; tile < tiles; tile++) {
      uint32_t& count = counts[chunk * tiles + tile];
      const uint32_t size = count;
      count = next[tile];
      next[tile] += size;
    }
  return begin;
}

}  // namespace

void TileBinner::bin(const View& view, const Splat* splats, int64_t n, bool want_slots, TileLists& out, uint32_t* rank,
                     uint8_t* visible) {
  // A fixed number of chunks at most: the cursors must not grow with Gaussians times tiles.
  const int64_t chunk_size = std::max<int64_t>(1024, (n + kMaxChunks - 1) / kMaxChunks);
  const int64_t chunks = (n + chunk_size - 1) / chunk_size, tiles = int64_t(view.tiles_x) * view.tiles_y;
  if (covered_.empty()) covered_ = std::vector<Buffer<Slot>>(kMaxChunks);
  uint32_t* cursor = cursor_.resize(chunks * tiles);
  uint32_t* slot_begin = out.slot_begin.resize(n + 1);
  std::vector<uint32_t> base(chunks + 1, 0);

  parallel_for(chunks, [&](int64_t chunk, int) {
    const int64_t first = chunk * chunk_size, last = std::min(n, first + chunk_size);
    int64_t room = 8 * chunk_size + tiles + kTilesAtOnce, size = 0;
    Slot* list = covered_[chunk].resize(room);
    for (int64_t i = first; (i = kernels().cover(view, splats, i, last, slot_begin, list, room, &size)) < last;)
      list = covered_[chunk].grow(size, room = 2 * room);
    uint32_t* count = cursor + chunk * tiles;
    std::memset(count, 0, sizeof(uint32_t) * tiles);
    for (int64_t k = 0; k < size; k++) count[list[k].tile]++;
    for (int64_t i = first; i < last; i++) {
      const bool reaches = slot_begin[i] < (i + 1 < last ? slot_begin[i + 1] : uint32_t(size));
      rank[splats[i].index] = reaches ? uint32_t(i) : kHidden;
      visible[splats[i].index] = reaches;
    }
    base[chunk + 1] = uint32_t(size);
  });

  uint64_t total = 0;
  for (int64_t chunk = 0; chunk < chunks; chunk++) {
    total += base[chunk + 1];
    base[chunk + 1] = uint32_t(total);
  }
  if (total >= kHidden) throw std::length_error("more than 2^32 (tile, Gaussian) pairs: fewer or smaller Gaussians are needed");
  slot_begin[n] = uint32_t(total);
  out.n_entries = int64_t(total);
  const uint32_t* tile_begin = begin_of_tiles(cursor, chunks, tiles, out);

  uint32_t* entries = out.entries.resize(total);
  Slot* slots = want_slots ? out.slots.resize(total) : nullptr;
  parallel_for(chunks, [&](int64_t chunk, int) {
    const int64_t first = chunk * chunk_size, last = std::min(n, first + chunk_size);
    for (int64_t i = first; i < last; i++) slot_begin[i] += base[chunk];
    const Slot* list = covered_[chunk].data();
    uint32_t* next = cursor + chunk * tiles;
    const int64_t size = base[chunk + 1] - base[chunk];
    for (int64_t k = 0; k < size; k++) {
      const uint32_t tile = list[k].tile, at = next[tile]++;
      entries[at] = list[k].place;
      if (slots) slots[base[chunk] + k] = {tile, at - tile_begin[tile]};
    }
  });
}

void sort_by_depth(uint64_t* keys, uint64_t* tmp, int64_t n) {
  constexpr int kBits = 11, kBuckets = 1 << kBits, kPasses = 3, kBlocks = 8;
  static_assert(kPasses * kBits >= 32, "the passes cover the key");
  std::vector<uint32_t> counts(kBlocks * kBuckets);
  const int64_t block_size = (n + kBlocks - 1) / kBlocks;
  uint64_t *from = keys, *to = tmp;
  for (int pass = 0; pass < kPasses; pass++) {
    const auto digit = [&](int64_t i) { return from[i] >> (32 + pass * kBits) & (kBuckets - 1); };
    const auto each = [&](int64_t block, auto&& act) {
      for (int64_t i = block * block_size, last = std::min(n, i + block_size); i < last; i++) act(i);
    };
    parallel_for(kBlocks, [&](int64_t block, int) {
      uint32_t* count = &counts[block * kBuckets];
      std::fill_n(count, kBuckets, 0u);
      each(block, [&](int64_t i) { count[digit(i)]++; });
    });
    uint32_t place = 0;
    for (int bucket = 0; bucket < kBuckets; bucket++)
      for (int block = 0; block < kBlocks; block++) {
        const uint32_t size = counts[block * kBuckets + bucket];
        counts[block * kBuckets + bucket] = place;
        place += size;
      }
    parallel_for(kBlocks, [&](int64_t block, int) {
      uint32_t* start = &counts[block * kBuckets];
      each(block, [&](int64_t i) { to[start[digit(i)]++] = from[i]; });
    });
    std::swap(from, to);
  }
  std::memcpy(keys, tmp, sizeof(uint64_t) * n);
}

}  // namespace dd
