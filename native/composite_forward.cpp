// Front-to-back compositing of one tile (Kerbl et al. 2023, eq. 3), rows of lanes at a time.
#include "kernel_list.h"
#include "tile.h"

namespace dd::DD_ISA {
namespace {

// Running sums of a tile. A pixel that stopped holds its transmittance with a minus sign.
struct State {
  alignas(64) float transmittance[kTilePixels], red[kTilePixels], green[kTilePixels], blue[kTilePixels];
  alignas(64) float depth[kTilePixels];
  alignas(64) int32_t last[kTilePixels];
  uint32_t alive[kStrips];  // one bit a row
};

void start(const TileTask& task, State& state) {
  __builtin_memset(&state, 0, sizeof(state));
  for (int i = 0; i < kTilePixels; i++) state.last[i] = -1;
  for (int strip = 0; strip < kStrips; strip++)
    for (int row = 0; row < kTile; row++)
      for (int l = 0; l < kLanes; l++) {
        const bool inside = task.tile_x * kTile + strip * kLanes + l < task.view->width &&
                            task.tile_y * kTile + row < task.view->height;
        state.transmittance[at(strip, row) + l] = inside ? 1.0f : -1.0f;
      }
}

bool update_alive(State& state) {
  uint32_t all = 0;
  for (int strip = 0; strip < kStrips; strip++) {
    uint32_t rows = 0;
    for (int row = 0; row < kTile; row++)
      rows |= uint32_t(any(load(state.transmittance + at(strip, row)) > 0.0f)) << row;
    all |= state.alive[strip] = rows;
  }
  return all != 0;
}

static inline void add(float* sum, V weight, float value) { store(sum, load(sum) + weight * value); }

template <bool kKeepLast, bool kChannels>
void blend(const TileTask& task, State& state, int i, float left, float top) {
  const Splat& s = task.splats[task.entries[i]];
  const Span reach = span(s, left, top);
  for (int strip = reach.first_strip; strip <= reach.last_strip; strip++) {
    const RowPower power(s, iota() + (left + 0.5f + float(strip * kLanes) - s.u));
    for (int row = reach.first_row; row <= reach.last_row; row++) {
      if (!(state.alive[strip] >> row & 1)) continue;
      const int k = at(strip, row);
      const V p = power.at(top + 0.5f + float(row) - s.v);
      const I seen = p >= kMinPower;
      const V alpha = vmin(masked(seen, exp2_bounded(p)), broadcast(kMaxAlpha));
      const V before = load(state.transmittance + k), part = before * alpha, after = before - part;
      const I added = after > kMinTransmittance;
      const V weight = masked(added, part);
      store(state.transmittance + k, added ? after : (V)((U)before | 0x80000000u));
      add(state.red + k, weight, s.colour[0]);
      add(state.green + k, weight, s.colour[1]);
      add(state.blue + k, weight, s.colour[2]);
      add(state.depth + k, weight, s.depth);
      if (kKeepLast) store(state.last + k, (seen & added) ? broadcast(int32_t(i)) : load(state.last + k));
      if (kChannels)
        for (int c = 0; c < task.n_channels; c++)
          add(task.scratch + c * kTilePixels + k, weight, task.channels[int64_t(s.index) * task.n_channels + c]);
    }
  }
}

template <bool kKeepLast, bool kChannels>
void blend_all(const TileTask& task, State& state) {
  const float left = float(task.tile_x * kTile), top = float(task.tile_y * kTile);
  for (int i = 0; i < task.n_entries; i++) {
    if ((i & 15) == 0 && !update_alive(state)) return;
    blend<kKeepLast, kChannels>(task, state, i, left, top);
  }
}

void finish(const TileTask& task, const State& state, const Images& out) {
  const int width = task.view->width, x0 = task.tile_x * kTile, y0 = task.tile_y * kTile;
  const int rows = task.view->height - y0 < kTile ? task.view->height - y0 : kTile;
  const int columns = width - x0 < kTile ? width - x0 : kTile;
  for (int row = 0; row < rows; row++)
    for (int column = 0; column < columns; column++) {
      const int k = at(column / kLanes, row) + column % kLanes;
      const int64_t pixel = int64_t(y0 + row) * width + x0 + column;
      out.colour[3 * pixel] = state.red[k];
      out.colour[3 * pixel + 1] = state.green[k];
      out.colour[3 * pixel + 2] = state.blue[k];
      out.depth[pixel] = state.depth[k];
      out.alpha[pixel] = 1.0f - __builtin_fabsf(state.transmittance[k]);
      for (int c = 0; c < task.n_channels; c++)
        out.channels[pixel * task.n_channels + c] = task.scratch[c * kTilePixels + k];
    }
  if (!task.last) return;
  for (int k = 0; k < kTilePixels; k++) task.transmittance[k] = __builtin_fabsf(state.transmittance[k]);
  __builtin_memcpy(task.last, state.last, sizeof(state.last));
}

}  // namespace

void composite(const TileTask& task, const Images& out) {
  State state;
  start(task, state);
  __builtin_memset(task.scratch, 0, sizeof(float) * kTilePixels * task.n_channels);
  if (task.n_channels)
    task.last ? blend_all<true, true>(task, state) : blend_all<false, true>(task, state);
  else
    task.last ? blend_all<true, false>(task, state) : blend_all<false, false>(task, state);
  finish(task, state, out);
}

}  // namespace dd::DD_ISA
