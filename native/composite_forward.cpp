// Front-to-back compositing of one tile (Kerbl et al. 2023, eq. 3), rows of lanes at a time.
#include "kernel_list.h"
#include "tile.h"

namespace dd::DD_ISA {
namespace {

// Running sums of a row of lanes. A pixel that stopped holds its transmittance with a minus sign.
struct Cell {
  V transmittance, red, green, blue, depth;
  I last;
};

struct State {
  Cell cells[kStrips][kTile];
  uint32_t alive[kStrips];  // one bit a row
};

void start(const TileTask& task, State& state) {
  for (int strip = 0; strip < kStrips; strip++)
    for (int row = 0; row < kTile; row++) {
      const V column = iota() + float(task.tile_x * kTile + strip * kLanes);
      const bool inside = task.tile_y * kTile + row < task.view->height;
      Cell& cell = state.cells[strip][row];
      cell.transmittance =
          (column < float(task.view->width)) & broadcast(int32_t(inside ? -1 : 0)) ? broadcast(1.0f) : broadcast(-1.0f);
      cell.red = cell.green = cell.blue = cell.depth = V{};
      cell.last = broadcast(int32_t(-1));
    }
}

bool update_alive(State& state) {
  uint32_t all = 0;
  for (int strip = 0; strip < kStrips; strip++) {
    uint32_t rows = 0;
    for (int row = 0; row < kTile; row++) rows |= uint32_t(any(state.cells[strip][row].transmittance > 0.0f)) << row;
    all |= state.alive[strip] = rows;
  }
  return all != 0;
}

template <bool kKeepLast, bool kChannels>
void blend(const TileTask& task, State& state, int i, float left, float top) {
  const Splat& s = task.splats[task.entries[i]];
  const Span reach = span(s, left, top);
  const V red = broadcast(s.colour[0]), green = broadcast(s.colour[1]), blue = broadcast(s.colour[2]);
  const V depth = broadcast(s.depth);
  const I number = broadcast(int32_t(i));
  for (int strip = reach.first_strip; strip <= reach.last_strip; strip++) {
    const Strip lanes(s, left + float(strip * kLanes));
    for (int row = reach.first_row; row <= reach.last_row; row++) {
      if (!(state.alive[strip] >> row & 1)) continue;
      Cell& cell = state.cells[strip][row];
      const float dy = top + 0.5f + float(row) - s.v;
      const V p = lanes.power(lanes.e(dy), dy);
      const I seen = p >= kMinPower;
      const V alpha = vmin(masked(seen, exp2_bounded(p)), broadcast(kMaxAlpha));
      const V before = cell.transmittance, part = before * alpha, after = before - part;
      const I added = after > kMinTransmittance;
      const V weight = masked(added, part);
      cell.transmittance = added ? after : (V)((U)before | 0x80000000u);
      cell.red += weight * red;
      cell.green += weight * green;
      cell.blue += weight * blue;
      cell.depth += weight * depth;
      if (kKeepLast) cell.last = (seen & added) ? number : cell.last;
      if (kChannels)
        for (int c = 0; c < task.n_channels; c++) {
          float* sum = task.scratch + c * kTilePixels + at(strip, row);
          store(sum, load(sum) + weight * task.channels[int64_t(s.index) * task.n_channels + c]);
        }
    }
  }
}

template <bool kKeepLast, bool kChannels>
void blend_all(const TileTask& task, State& state) {
  constexpr int kAhead = 6;
  const float left = float(task.tile_x * kTile), top = float(task.tile_y * kTile);
  for (int i = 0; i < task.n_entries; i++) {
    if ((i & 15) == 0 && !update_alive(state)) return;
    if (i + kAhead < task.n_entries) __builtin_prefetch(&task.splats[task.entries[i + kAhead]]);
    blend<kKeepLast, kChannels>(task, state, i, left, top);
  }
}

void finish(const TileTask& task, const State& state, const Images& out) {
  const int width = task.view->width, x0 = task.tile_x * kTile, y0 = task.tile_y * kTile;
  const int rows = task.view->height - y0 < kTile ? task.view->height - y0 : kTile;
  const int columns = width - x0 < kTile ? width - x0 : kTile;
  for (int row = 0; row < rows; row++)
    for (int column = 0; column < columns; column++) {
      const int strip = column / kLanes, lane = column % kLanes;
      const Cell& cell = state.cells[strip][row];
      const int64_t pixel = int64_t(y0 + row) * width + x0 + column;
      out.colour[3 * pixel] = cell.red[lane];
      out.colour[3 * pixel + 1] = cell.green[lane];
      out.colour[3 * pixel + 2] = cell.blue[lane];
      out.depth[pixel] = cell.depth[lane];
      out.alpha[pixel] = 1.0f - __builtin_fabsf(cell.transmittance[lane]);
      for (int c = 0; c < task.n_channels; c++)
        out.channels[pixel * task.n_channels + c] = task.scratch[c * kTilePixels + at(strip, row) + lane];
    }
  if (!task.last) return;
  for (int strip = 0; strip < kStrips; strip++)
    for (int row = 0; row < kTile; row++) {
      store(task.transmittance + at(strip, row), vabs(state.cells[strip][row].transmittance));
      store(task.last + at(strip, row), state.cells[strip][row].last);
    }
}

}  // namespace

void composite(const TileTask& task, const Images& out) {
  State state;
  start(task, state);
  if (task.n_channels) {
    __builtin_memset(task.scratch, 0, sizeof(float) * kTilePixels * task.n_channels);
    task.last ? blend_all<true, true>(task, state) : blend_all<false, true>(task, state);
  } else {
    task.last ? blend_all<true, false>(task, state) : blend_all<false, false>(task, state);
  }
  finish(task, state, out);
}

}  // namespace dd::DD_ISA
