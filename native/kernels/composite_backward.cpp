// Gradient of the compositing of one tile, back to front: transmittance and the light from behind are rebuilt per pixel.
#include "kernel_list.h"
#include "tile.h"

namespace dd::DD_ISA {
namespace {

// kLanes pixels. floor: as in the forward pass; before: transmittance in front of what was handled so far; behind: sum
// of weight * (value . upstream) handled so far; red to depth: upstream gradients.
struct Cell {
  V floor, before, behind, red, green, blue, depth;
};

struct State {
  Cell cells[kCells];
  Cells alive;              // those with a pixel that takes light from this entry
  float* channels;          // upstream, 256 a channel
  float* sums;              // kLanes a channel
};

void load_pixel(const TileTask& task, const ImageGradients& in, State& state, int cell, int lane, int64_t pixel) {
  Cell& c = state.cells[cell];
  if (in.colour) {
    c.red[lane] = in.colour[3 * pixel];
    c.green[lane] = in.colour[3 * pixel + 1];
    c.blue[lane] = in.colour[3 * pixel + 2];
  }
  if (in.depth) c.depth[lane] = in.depth[pixel];
  // alpha = 1 - T_end and dT_end/dalpha_i = -T_end / (1 - alpha_i): the same form as the light from behind.
  if (in.alpha) c.behind[lane] = -in.alpha[pixel] * c.before[lane];
  if (in.channels)
    for (int k = 0; k < task.n_channels; k++)
      state.channels[k * kTilePixels + pixel_of(cell) + lane] = in.channels[pixel * task.n_channels + k];
}

// Whether a pixel takes light from the entries that follow.
void wake(State& state, int pixel) {
  state.cells[cell_of(pixel)].floor[pixel % kLanes] = kMinPower;
  state.alive |= Cells(1) << cell_of(pixel);
}
void put_to_sleep(State& state, int pixel) {
  V& floor = state.cells[cell_of(pixel)].floor;
  floor[pixel % kLanes] = kNever;
  if (!any(floor < kNever)) state.alive &= ~(Cells(1) << cell_of(pixel));
}

void start(const TileTask& task, const ImageGradients& in, State& state) {
  __builtin_memset(&state, 0, sizeof(state));
  state.channels = task.scratch;
  state.sums = task.scratch + task.n_channels * kTilePixels;
  if (task.n_channels) __builtin_memset(task.scratch, 0, sizeof(float) * task.n_channels * kTilePixels);
  const int width = task.view->width, x0 = task.tile_x * kTile, y0 = task.tile_y * kTile;
  for (int cell = 0; cell < kCells; cell++) {
    state.cells[cell].before = load(task.record->transmittance + pixel_of(cell));
    state.cells[cell].floor = broadcast(kNever);
    const int first = x0 + first_column(cell), y = y0 + cell % kTile;
    for (int lane = 0; lane < kLanes && y < task.view->height && first + lane < width; lane++) {
      load_pixel(task, in, state, cell, lane, int64_t(y) * width + first + lane);
      wake(state, pixel_of(cell) + lane);
    }
  }
  for (int k = 0; k < task.record->n_stops; k++) put_to_sleep(state, task.record->stop_pixel[k]);
}

// The sums of EntryGradient, still one per lane.
struct LaneSums {
  V v = V{}, v_e = V{}, v_ee = V{}, v_y = V{}, v_ey = V{}, v_yy = V{};
  V red = V{}, green = V{}, blue = V{}, depth = V{};
  V absolute_u = V{}, absolute_v = V{};
};

// What is done beyond the common case: alpha may reach its cap; extra channels; absolute gradients.
template <bool kOpaque_, bool kChannels_, bool kAbsolute_>
struct Extras {
  static constexpr bool kOpaque = kOpaque_, kChannels = kChannels_, kAbsolute = kAbsolute_;
};

template <class Extra>
static inline void cell_gradient(const TileTask& task, State& state, const Splat& s, int number, V e, V p, V dy,
                                 const float* values, LaneSums& sums) {
  Cell& cell = state.cells[number];
  const V raw = masked(p >= cell.floor, exp2_bounded(p));
  const V alpha = Extra::kOpaque ? vmin(raw, broadcast(kMaxAlpha)) : raw;
  const V inverse = 1.0f / (1.0f - alpha);
  const V before = cell.before * inverse, weight = alpha * before;
  V value = s.colour[0] * cell.red + s.colour[1] * cell.green + s.colour[2] * cell.blue + s.depth * cell.depth;
  sums.red += weight * cell.red;
  sums.green += weight * cell.green;
  sums.blue += weight * cell.blue;
  sums.depth += weight * cell.depth;
  if (Extra::kChannels)
    for (int c = 0; c < task.n_channels; c++) {
      const V upstream = load(state.channels + c * kTilePixels + pixel_of(number));
      value += values[c] * upstream;
      store(state.sums + c * kLanes, load(state.sums + c * kLanes) + weight * upstream);
    }
  // alpha dL/dalpha: the light it adds less what it takes from all behind it.
  V v = weight * value - (alpha * inverse) * cell.behind;
  if (Extra::kOpaque) v = masked(raw <= kMaxAlpha, v);
  cell.before = before;
  cell.behind += weight * value;
  const V v_e = v * e;
  sums.v += v;
  sums.v_e += v_e;
  sums.v_ee += v_e * e;
  sums.v_y += v * dy;
  sums.v_ey += v_e * dy;
  sums.v_yy += v * (dy * dy);
  if (Extra::kAbsolute) {
    // dL/du = v e and dL/dv = v f with f = (dy - slope_x cov_yy e) / cov_yy; across = -log2(e) / (2 cov_yy).
    sums.absolute_u += vabs(v_e);
    sums.absolute_v += vabs(v * (dy * (s.across * (-2.0f / kLog2e))) - s.slope_x * v_e);
  }
}

template <class Extra>
void entry_gradient(const TileTask& task, State& state, const Splat& s, Cells cells, float left, float top,
                    EntryGradient& out, float* out_channels) {
  const float* values = Extra::kChannels ? task.channels + int64_t(s.index) * task.n_channels : nullptr;
  const Form form(s, left, top);
  LaneSums sums;
  if (Extra::kChannels) __builtin_memset(state.sums, 0, sizeof(float) * kLanes * task.n_channels);
  for (cells &= state.alive; cells; cells &= cells - 1) {
    const int cell = __builtin_ctzll(cells);
    const V e = form.e(cell);
    cell_gradient<Extra>(task, state, s, cell, e, form.power(cell, e), form.dy(cell), values, sums);
  }
  float* to = &out.v;
  const V4 a = sum_lanes(sums.v, sums.v_e, sums.v_ee, sums.v_y);
  const V4 b = sum_lanes(sums.v_ey, sums.v_yy, sums.red, sums.green);
  const V4 c = sum_lanes(sums.blue, sums.depth, sums.absolute_u, sums.absolute_v);
  __builtin_memcpy(to, &a, 16);
  __builtin_memcpy(to + 4, &b, 16);
  __builtin_memcpy(to + 8, &c, 16);
  if (Extra::kChannels)
    for (int ch = 0; ch < task.n_channels; ch++) out_channels[ch] = sum_lanes(load(state.sums + ch * kLanes));
}

template <bool kChannels, bool kAbsolute>
void all_entries(const TileTask& task, State& state, EntryGradient* out, float* out_channels) {
  const float left = float(task.tile_x * kTile), top = float(task.tile_y * kTile);
  const TileRecord& record = *task.record;
  Batch batch;
  int n_stops = record.n_stops;
  for (int last = record.n_reached; last > 0; last -= Batch::kSize) {
    const int first = last > Batch::kSize ? last - Batch::kSize : 0;
    batch.look(task, first, last, first > Batch::kSize ? first - Batch::kSize : 0, first);
    for (int i = last - 1; i >= first; i--) {
      // Pixels that stopped behind this entry take part from here on.
      for (; n_stops > 0 && record.stop_entry[n_stops - 1] > i; n_stops--) wake(state, record.stop_pixel[n_stops - 1]);
      const Splat& s = *batch.splats[i - first];
      const Cells cells = batch.cells[i - first];
      float* to = kChannels ? out_channels + int64_t(i) * task.n_channels : nullptr;
      s.log2_opacity > kMaxPower
          ? entry_gradient<Extras<true, kChannels, kAbsolute>>(task, state, s, cells, left, top, out[i], to)
          : entry_gradient<Extras<false, kChannels, kAbsolute>>(task, state, s, cells, left, top, out[i], to);
    }
  }
}

}  // namespace

void composite_backward(const TileTask& task, const ImageGradients& in, bool absolute, EntryGradient* out,
                        float* out_channels) {
  State state;
  start(task, in, state);
  if (task.n_channels)
    absolute ? all_entries<true, true>(task, state, out, out_channels)
             : all_entries<true, false>(task, state, out, out_channels);
  else
    absolute ? all_entries<false, true>(task, state, out, nullptr) : all_entries<false, false>(task, state, out, nullptr);
}

}  // namespace dd::DD_ISA
