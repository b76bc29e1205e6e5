#include "tiles.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>

#include "threads.h"

namespace dd {
namespace {

constexpr int kBinChunk = 1024;

// Range of x (relative to the centre) of the ellipse alpha >= 1/255 within a band of y.
struct Ellipse {
  float reach_x, reach_y, slant, half_width, extreme_y;

  explicit Ellipse(const Splat& s) : reach_x(s.reach_x), reach_y(s.reach_y) {
    // At dy = 0 the form is along (conic_xx dx)^2.
    slant = s.slope_x;
    half_width = 1.0001f * std::sqrt((s.log2_opacity - kMinPower) / -s.along) / s.conic_xx + 1e-3f;
    extreme_y = s.slope_y * s.reach_x;  // where the right-most point lies
  }

  float side(float y) const {
    const float share = y / reach_y;
    return half_width * std::sqrt(std::max(0.0f, 1.0f - share * share));
  }
  float right(float low, float high) const {
    if (extreme_y >= low && extreme_y <= high) return reach_x;
    const float y = extreme_y < low ? low : high;
    return slant * y + side(y) + 1e-3f;
  }
  float left(float low, float high) const { return -right(-high, -low); }
};

int clamp_tile(float x, int count) { return int(std::min(float(count - 1), std::max(0.0f, x))); }

// First and last tile along one axis whose pixel centres meet [low, high]; the centres of tile t are 16 t + 0.5 ... 16 t + 15.5.
int first_tile(float low, int count) { return clamp_tile(std::ceil((low - (kTile - 0.5f)) / kTile), count); }
int last_tile(float high, int count) { return clamp_tile(std::floor((high - 0.5f) / kTile), count); }

template <class Push>
void tiles_of(const View& view, const Splat& s, Push&& push) {
  const int y0 = first_tile(s.v - s.reach_y, view.tiles_y), y1 = last_tile(s.v + s.reach_y, view.tiles_y);
  const int x0 = first_tile(s.u - s.reach_x, view.tiles_x), x1 = last_tile(s.u + s.reach_x, view.tiles_x);
  if (x0 >= x1 && y0 >= y1) {
    if (x0 == x1 && y0 == y1) push(y0 * view.tiles_x + x0);
    return;
  }
  const Ellipse ellipse(s);
  for (int y = y0; y <= y1; y++) {
    const float bottom = std::min(float(y * kTile + kTile), float(view.height)) - 0.5f;
    const float low = std::max(float(y * kTile) + 0.5f - s.v, -s.reach_y), high = std::min(bottom - s.v, s.reach_y);
    if (low > high) continue;
    const float left = s.u + ellipse.left(low, high), right = s.u + ellipse.right(low, high);
    if (right < 0.5f || left > float(view.width) - 0.5f) continue;
    const int end = std::min(x1, last_tile(right, view.tiles_x));
    for (int x = std::max(x0, first_tile(left, view.tiles_x)); x <= end; x++) push(y * view.tiles_x + x);
  }
}

}  // namespace

void TileBinner::bin(const View& view, const Splat* splats, int64_t n, TileLists& out) {
  const int64_t chunks = (n + kBinChunk - 1) / kBinChunk, tiles = int64_t(view.tiles_x) * view.tiles_y;
  if (int64_t(tiles_of_chunk_.size()) < chunks) tiles_of_chunk_ = std::vector<Buffer<uint32_t>>(chunks);
  uint32_t* cursor = cursor_.resize(chunks * tiles + 1);
  uint32_t* base = slot_base_.resize(chunks + 1);
  uint32_t* slot_begin = out.slot_begin.resize(n + 1);

  parallel_for(chunks, [&](int64_t chunk, int) {
    const int64_t first = chunk * kBinChunk, last = std::min(n, first + kBinChunk);
    uint32_t* count = cursor + chunk * tiles;
    std::memset(count, 0, sizeof(uint32_t) * tiles);
    Buffer<uint32_t>& list = tiles_of_chunk_[chunk];
    size_t size = 0, room = 8 * kBinChunk;
    uint32_t* to = list.resize(room);
    for (int64_t i = first; i < last; i++) {
      slot_begin[i] = uint32_t(size);
      if (size + tiles > room) {
        std::vector<uint32_t> kept(to, to + size);
        room = 2 * (size + tiles);
        to = list.resize(room);
        std::copy(kept.begin(), kept.end(), to);
      }
      tiles_of(view, splats[i], [&](int tile) {
        to[size++] = uint32_t(tile);
        count[tile]++;
      });
    }
    base[chunk] = uint32_t(size);
  });

  uint64_t total = 0;
  for (int64_t chunk = 0; chunk < chunks; chunk++) {
    const uint32_t size = base[chunk];
    base[chunk] = uint32_t(total);
    total += size;
  }
  if (total >= kHidden) throw std::length_error("more than 2^32 (tile, Gaussian) pairs: fewer or smaller Gaussians are needed");
  base[chunks] = slot_begin[n] = uint32_t(total);
  out.n_entries = int64_t(total);
  uint32_t* tile_begin = out.tile_begin.resize(tiles + 1);
  uint32_t place = 0;
  for (int64_t tile = 0; tile < tiles; tile++) {
    tile_begin[tile] = place;
    for (int64_t chunk = 0; chunk < chunks; chunk++) {
      uint32_t& count = cursor[chunk * tiles + tile];
      const uint32_t size = count;
      count = place;
      place += size;
    }
  }
  tile_begin[tiles] = place;

  uint32_t *entries = out.entries.resize(total), *slots = out.slots.resize(total);
  parallel_for(chunks, [&](int64_t chunk, int) {
    const int64_t first = chunk * kBinChunk, last = std::min(n, first + kBinChunk);
    const uint32_t* tile = tiles_of_chunk_[chunk].data();
    uint32_t* next = cursor + chunk * tiles;
    const uint32_t size = base[chunk + 1] - base[chunk];
    for (int64_t i = first; i < last; i++) {
      const uint32_t end = i + 1 < last ? slot_begin[i + 1] : size;
      for (uint32_t k = slot_begin[i]; k < end; k++) {
        const uint32_t at = next[tile[k]]++;
        entries[at] = uint32_t(i);
        slots[base[chunk] + k] = at;
      }
      slot_begin[i] += base[chunk];
    }
  });
}

void sort_by_depth(uint64_t* keys, uint64_t* tmp, int64_t n) {
  constexpr int kBits = 11, kBuckets = 1 << kBits;
  static_assert(3 * kBits >= 32, "three passes cover the key");
  std::vector<uint32_t> counts(3 * kBuckets, 0);
  for (int64_t i = 0; i < n; i++)
    for (int pass = 0; pass < 3; pass++) counts[pass * kBuckets + (keys[i] >> (32 + pass * kBits) & (kBuckets - 1))]++;
  uint64_t *from = keys, *to = tmp;
  for (int pass = 0; pass < 3; pass++) {
    uint32_t* start = counts.data() + pass * kBuckets;
    uint32_t place = 0;
    for (int b = 0; b < kBuckets; b++) {
      const uint32_t size = start[b];
      start[b] = place;
      place += size;
    }
    for (int64_t i = 0; i < n; i++) to[start[from[i] >> (32 + pass * kBits) & (kBuckets - 1)]++] = from[i];
    std::swap(from, to);
  }
  std::memcpy(keys, tmp, sizeof(uint64_t) * n);
}

}  // namespace dd
