// Gradient of the compositing of one tile, back to front: transmittance and the light from behind are rebuilt per pixel.
#include "kernel_list.h"
#include "tile.h"

namespace dd::DD_ISA {
namespace {

// A row of lanes. before: transmittance in front of what was handled so far; behind: sum of weight * (value . upstream)
// handled so far; red to depth: upstream gradients.
struct Cell {
  V before, behind, red, green, blue, depth;
  I last;
};

struct State {
  Cell cells[kStrips][kTile];
  int32_t last_of_row[kStrips][kTile];
  float* channels;  // upstream, 256 a channel
  float* sums;      // kLanes a channel
};

void load_pixel(const TileTask& task, const ImageGradients& in, State& state, int strip, int row, int lane,
                int64_t pixel) {
  Cell& cell = state.cells[strip][row];
  if (in.colour) {
    cell.red[lane] = in.colour[3 * pixel];
    cell.green[lane] = in.colour[3 * pixel + 1];
    cell.blue[lane] = in.colour[3 * pixel + 2];
  }
  if (in.depth) cell.depth[lane] = in.depth[pixel];
  // alpha = 1 - T_end and dT_end/dalpha_i = -T_end / (1 - alpha_i): the same form as the light from behind.
  if (in.alpha) cell.behind[lane] = -in.alpha[pixel] * cell.before[lane];
  if (in.channels)
    for (int c = 0; c < task.n_channels; c++)
      state.channels[c * kTilePixels + at(strip, row) + lane] = in.channels[pixel * task.n_channels + c];
}

// Returns one more than the last entry that reached any pixel.
int start(const TileTask& task, const ImageGradients& in, State& state) {
  __builtin_memset(&state, 0, sizeof(state));
  state.channels = task.scratch;
  state.sums = task.scratch + task.n_channels * kTilePixels;
  if (task.n_channels) __builtin_memset(task.scratch, 0, sizeof(float) * task.n_channels * kTilePixels);
  const int width = task.view->width, x0 = task.tile_x * kTile, y0 = task.tile_y * kTile;
  int deepest = -1;
  for (int strip = 0; strip < kStrips; strip++)
    for (int row = 0; row < kTile; row++) {
      Cell& cell = state.cells[strip][row];
      cell.before = load(task.transmittance + at(strip, row));
      cell.last = load(task.last + at(strip, row));
      int32_t& row_last = state.last_of_row[strip][row] = -1;
      for (int lane = 0; lane < kLanes; lane++) {
        const int x = x0 + strip * kLanes + lane, y = y0 + row;
        if (x >= width || y >= task.view->height) continue;
        load_pixel(task, in, state, strip, row, lane, int64_t(y) * width + x);
        if (cell.last[lane] > row_last) row_last = cell.last[lane];
      }
      if (row_last > deepest) deepest = row_last;
    }
  return deepest + 1;
}

// The sums of EntryGradient, still one per lane.
struct LaneSums {
  V v = V{}, v_e = V{}, v_ee = V{}, v_y = V{}, v_ey = V{}, v_yy = V{};
  V red = V{}, green = V{}, blue = V{}, depth = V{};
};

static inline void add(V& sum, V value, V factor) { sum += value * factor; }

template <bool kChannels>
static inline void row_gradient(const TileTask& task, State& state, const Splat& s, int i, int strip, int row, V e, V p,
                                float dy, const float* values, LaneSums& sums) {
  Cell& cell = state.cells[strip][row];
  const I seen = (p >= kMinPower) & (cell.last >= broadcast(int32_t(i)));
  const V raw = masked(seen, exp2_bounded(p)), alpha = vmin(raw, broadcast(kMaxAlpha));
  const V inverse = 1.0f / (1.0f - alpha);
  const V before = cell.before * inverse, behind = cell.behind, weight = alpha * before;
  V value = s.colour[0] * cell.red + s.colour[1] * cell.green + s.colour[2] * cell.blue + s.depth * cell.depth;
  add(sums.red, weight, cell.red);
  add(sums.green, weight, cell.green);
  add(sums.blue, weight, cell.blue);
  add(sums.depth, weight, cell.depth);
  if (kChannels)
    for (int c = 0; c < task.n_channels; c++) {
      const V upstream = load(state.channels + c * kTilePixels + at(strip, row));
      value += values[c] * upstream;
      store(state.sums + c * kLanes, load(state.sums + c * kLanes) + weight * upstream);
    }
  cell.before = before;
  cell.behind = behind + weight * value;
  const V by_alpha = before * value - behind * inverse;
  const V v = masked(raw <= kMaxAlpha, alpha * by_alpha);
  const V v_e = v * e, v_y = v * dy;
  sums.v += v;
  sums.v_e += v_e;
  sums.v_y += v_y;
  add(sums.v_ee, v_e, e);
  add(sums.v_ey, v_y, e);
  sums.v_yy += v_y * dy;
}

template <bool kChannels>
void entry_gradient(const TileTask& task, State& state, int i, float left, float top, EntryGradient& out,
                    float* out_channels) {
  const Splat& s = task.splats[task.entries[i]];
  const float* values = kChannels ? task.channels + int64_t(s.index) * task.n_channels : nullptr;
  const Span reach = span(s, left, top);
  LaneSums sums;
  if (kChannels) __builtin_memset(state.sums, 0, sizeof(float) * kLanes * task.n_channels);
  for (int strip = reach.first_strip; strip <= reach.last_strip; strip++) {
    const Strip lanes(s, left + float(strip * kLanes));
    for (int row = reach.first_row; row <= reach.last_row; row++) {
      if (state.last_of_row[strip][row] < i) continue;
      const float dy = top + 0.5f + float(row) - s.v;
      const V e = lanes.e(dy);
      row_gradient<kChannels>(task, state, s, i, strip, row, e, lanes.power(e, dy), dy, values, sums);
    }
  }
  float* to = &out.v;
  const V4 a = sum_lanes(sums.v, sums.v_e, sums.v_ee, sums.v_y);
  const V4 b = sum_lanes(sums.v_ey, sums.v_yy, sums.red, sums.green);
  const V4 c = sum_lanes(sums.blue, sums.depth, V{}, V{});
  __builtin_memcpy(to, &a, 16);
  __builtin_memcpy(to + 4, &b, 16);
  __builtin_memcpy(to + 8, &c, 16);
  if (kChannels)
    for (int ch = 0; ch < task.n_channels; ch++) out_channels[ch] = sum_lanes(load(state.sums + ch * kLanes));
}

}  // namespace

void composite_backward(const TileTask& task, const ImageGradients& in, EntryGradient* out, float* out_channels) {
  constexpr int kAhead = 6;
  State state;
  const int n = start(task, in, state), channels = task.n_channels;
  const float left = float(task.tile_x * kTile), top = float(task.tile_y * kTile);
  for (int i = n - 1; i >= 0; i--) {
    if (i >= kAhead) __builtin_prefetch(&task.splats[task.entries[i - kAhead]]);
    channels ? entry_gradient<true>(task, state, i, left, top, out[i], out_channels + int64_t(i) * channels)
             : entry_gradient<false>(task, state, i, left, top, out[i], nullptr);
  }
  __builtin_memset(out + n, 0, sizeof(EntryGradient) * (task.n_entries - n));
  if (channels) __builtin_memset(out_channels + int64_t(n) * channels, 0, sizeof(float) * channels * (task.n_entries - n));
}

}  // namespace dd::DD_ISA
