// Front-to-back compositing of one tile (Kerbl et al. 2023, eq. 3), cells of lanes at a time.
#include "kernel_list.h"
#include "tile.h"

namespace dd::DD_ISA {
namespace {

// kLanes pixels: the power below which a Gaussian is skipped, what light is left, and the sums.
struct Cell {
  V floor, transmittance, red, green, blue, depth;
};

struct State {
  Cell cells[kCells];
  Cells alive;  // those with a pixel that still takes light
};

void start(const TileTask& task, State& state) {
  state.alive = 0;
  const int rows = task.view->height - task.tile_y * kTile;
  for (int cell = 0; cell < kCells; cell++) {
    Cell& c = state.cells[cell];
    const I inside = iota() + float(task.tile_x * kTile + first_column(cell)) < float(task.view->width);
    c.floor = cell % kTile < rows ? (inside ? broadcast(kMinPower) : broadcast(kNever)) : broadcast(kNever);
    c.transmittance = broadcast(1.0f);
    c.red = c.green = c.blue = c.depth = V{};
    state.alive |= Cells(any(c.floor < kNever)) << cell;
  }
  if (task.record) task.record->n_stops = 0;
}

// Pixels whose transmittance would fall too low stop here: they take no part of entry i, and none of what is behind it.
// Returns what the others take.
__attribute__((noinline)) V stop(const TileTask& task, State& state, int cell, int i, V part, V after) {
  Cell& c = state.cells[cell];
  const I going = after > kMinTransmittance;
  c.floor = going ? c.floor : broadcast(kNever);
  c.transmittance = going ? after : c.transmittance;
  if (!any(c.floor < kNever)) state.alive &= ~(Cells(1) << cell);
  if (TileRecord* record = task.record)
    for (int lane = 0; lane < kLanes; lane++)
      if (!going[lane]) {
        record->stop_entry[record->n_stops] = i;
        record->stop_pixel[record->n_stops++] = uint8_t(pixel_of(cell) + lane);
      }
  return masked(going, part);
}

template <bool kOpaque, bool kChannels>
void blend(const TileTask& task, State& state, int i, const Splat& s, Cells cells, float left, float top) {
  const V red = broadcast(s.colour[0]), green = broadcast(s.colour[1]), blue = broadcast(s.colour[2]);
  const V depth = broadcast(s.depth);
  const Form form(s, left, top);
  for (cells &= state.alive; cells; cells &= cells - 1) {
    const int cell = __builtin_ctzll(cells);
    Cell& c = state.cells[cell];
    const V p = form.power(cell, form.e(cell));
    V alpha = masked(p >= c.floor, exp2_bounded(p));
    if (kOpaque) alpha = vmin(alpha, broadcast(kMaxAlpha));
    V weight = c.transmittance * alpha;
    const V after = c.transmittance - weight;
    if (__builtin_expect(any(after <= kMinTransmittance), 0))
      weight = stop(task, state, cell, i, weight, after);
    else
      c.transmittance = after;
    c.red += weight * red;
    c.green += weight * green;
    c.blue += weight * blue;
    c.depth += weight * depth;
    if (kChannels)
      for (int k = 0; k < task.n_channels; k++) {
        float* sum = task.scratch + k * kTilePixels + pixel_of(cell);
        store(sum, load(sum) + weight * task.channels[int64_t(s.index) * task.n_channels + k]);
      }
  }
}

template <bool kChannels>
void blend_all(const TileTask& task, State& state) {
  const float left = float(task.tile_x * kTile), top = float(task.tile_y * kTile);
  Batch batch;
  int i = 0;
  const auto end_of = [&](int first) { return first + Batch::kSize < task.n_entries ? first + Batch::kSize : task.n_entries; };
  for (int first = 0; first < task.n_entries && state.alive; first += Batch::kSize) {
    const int last = end_of(first);
    batch.look(task, first, last, last, end_of(last));
    for (i = first; i < last && state.alive; i++) {
      const Splat& s = *batch.splats[i - first];
      const Cells cells = batch.cells[i - first];
      s.log2_opacity > kMaxPower ? blend<true, kChannels>(task, state, i, s, cells, left, top)
                                 : blend<false, kChannels>(task, state, i, s, cells, left, top);
    }
  }
  if (task.record) task.record->n_reached = i;
}

void finish(const TileTask& task, const State& state, const Images& out) {
  const int width = task.view->width, x0 = task.tile_x * kTile, y0 = task.tile_y * kTile;
  const int rows = task.view->height - y0 < kTile ? task.view->height - y0 : kTile;
  const int columns = width - x0 < kTile ? width - x0 : kTile;
  for (int row = 0; row < rows; row++)
    for (int column = 0; column < columns; column++) {
      const int number = cell_of(row * kTile + column), lane = column % kLanes;
      const Cell& cell = state.cells[number];
      const int64_t pixel = int64_t(y0 + row) * width + x0 + column;
      out.colour[3 * pixel] = cell.red[lane];
      out.colour[3 * pixel + 1] = cell.green[lane];
      out.colour[3 * pixel + 2] = cell.blue[lane];
      out.depth[pixel] = cell.depth[lane];
      out.alpha[pixel] = 1.0f - cell.transmittance[lane];
      for (int c = 0; c < task.n_channels; c++)
        out.channels[pixel * task.n_channels + c] = task.scratch[c * kTilePixels + row * kTile + column];
    }
  if (!task.record) return;
  for (int cell = 0; cell < kCells; cell++)
    store(task.record->transmittance + pixel_of(cell), state.cells[cell].transmittance);
}

}  // namespace

void composite(const TileTask& task, const Images& out) {
  State state;
  start(task, state);
  if (task.n_channels) {
    __builtin_memset(task.scratch, 0, sizeof(float) * kTilePixels * task.n_channels);
    blend_all<true>(task, state);
  } else {
    blend_all<false>(task, state);
  }
  finish(task, state, out);
}

}  // namespace dd::DD_ISA
