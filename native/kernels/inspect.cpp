// What each entry of a tile gives to its pixels, and the depth at which a pixel is half covered: compositing once more,
// without colour.
#include "kernel_list.h"
#include "tile.h"

namespace dd::DD_ISA {
namespace {

struct State {
  V floor[kCells], transmittance[kCells], median[kCells];
};

void start(const TileTask& task, State& state) {
  for (int cell = 0; cell < kCells; cell++) {
    const I inside = iota() + float(task.tile_x * kTile + first_column(cell)) < float(task.view->width);
    const bool row_inside = task.tile_y * kTile + cell % kTile < task.view->height;
    state.floor[cell] = row_inside ? (inside ? broadcast(kMinPower) : broadcast(kNever)) : broadcast(kNever);
    state.transmittance[cell] = broadcast(1.0f);
    state.median[cell] = V{};
  }
}

Contribution weigh(State& state, const Splat& s, Cells cells, float left, float top) {
  const Form form(s, left, top);
  V sum = V{}, most = V{};
  for (; cells; cells &= cells - 1) {
    const int cell = __builtin_ctzll(cells);
    const V p = form.power(cell, form.e(cell));
    const V alpha = vmin(masked(p >= state.floor[cell], exp2_bounded(p)), broadcast(kMaxAlpha));
    const V before = state.transmittance[cell], after = before - before * alpha;
    const I going = after > kMinTransmittance;
    const V weight = masked(going, before - after);
    state.floor[cell] = going ? state.floor[cell] : broadcast(kNever);
    state.transmittance[cell] = going ? after : before;
    state.median[cell] = (before > 0.5f) & (after <= 0.5f) ? broadcast(s.depth) : state.median[cell];
    sum += weight;
    most = vmax(most, weight);
  }
  Contribution out = {sum_lanes(sum), 0.0f};
  for (int lane = 0; lane < kLanes; lane++) out.most = most[lane] > out.most ? most[lane] : out.most;
  return out;
}

}  // namespace

void inspect(const TileTask& task, float* median, Contribution* out) {
  const float left = float(task.tile_x * kTile), top = float(task.tile_y * kTile);
  const int n = task.record->n_reached, width = task.view->width;
  State state;
  start(task, state);
  for (int i = 0; i < n; i++) {
    const Splat& s = task.splats[task.entries[i]];
    out[i] = weigh(state, s, reached_cells(s, left, top), left, top);
  }
  for (int pixel = 0; pixel < kTilePixels; pixel++) {
    const int x = task.tile_x * kTile + pixel % kTile, y = task.tile_y * kTile + pixel / kTile;
    if (x < width && y < task.view->height)
      median[int64_t(y) * width + x] = state.median[cell_of(pixel)][pixel % kLanes];
  }
}

}  // namespace dd::DD_ISA
