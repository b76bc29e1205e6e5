// The tiles that the ellipses alpha >= 1/255 of splats meet, a row of tiles to a lane.
#include "kernel_list.h"
#include "lanes.h"

namespace dd::DD_ISA {
namespace {

static inline int within(float x, int count) { return int(x < 0.0f ? 0.0f : x > float(count - 1) ? float(count - 1) : x); }
static inline V within(V x, float low, float high) { return vmin(vmax(x, broadcast(low)), broadcast(high)); }
static inline V rounded_down(V x) {
  const V whole = __builtin_convertvector(__builtin_convertvector(x, I), V);
  return whole > x ? whole - 1.0f : whole;
}

// First and last tile of each of kLanes rows of tiles from `row` on; last < first where there is none.
struct Rows {
  alignas(64) int32_t first[kLanes], last[kLanes];

  Rows(const View& view, const Splat& s, int row) {
    const V top = (iota() + float(row)) * float(kTile);
    // The first and last pixel centres of a row of tiles, relative to the splat, as far as the ellipse reaches. Both are
    // rounded once, after the centre: the two are the same where the row holds one pixel.
    const V bottom = vmin(top + float(kTile), broadcast(float(view.height)));
    const V low = vmax((top + 0.5f) - s.v, broadcast(-s.reach_y)), high = vmin((bottom - 0.5f) - s.v, broadcast(s.reach_y));
    const float extreme = s.slope_x * s.reach_y * s.reach_y / s.reach_x;  // the right-most point; the left-most opposite
    const V right = side(s, vmin(vmax(broadcast(extreme), low), high), extreme);
    const V left = -side(s, -vmin(vmax(broadcast(-extreme), low), high), extreme);
    // The centres of tile t are 16 t + 0.5 ... 16 t + 15.5.
    const float end = float(view.tiles_x - 1), scale = 1.0f / kTile;
    const V from = -rounded_down(-within((left + (s.u - (kTile - 0.5f))) * scale, -1.0f, end));
    const V to = rounded_down(within((right + (s.u - 0.5f)) * scale, -1.0f, end));
    const I present = (low <= high) & (left + s.u <= float(view.width) - 0.5f);
    store(first, __builtin_convertvector(vmax(from, V{}), I));
    store(last, present ? __builtin_convertvector(to, I) : broadcast(int32_t(-1)));
  }

  // The right end of the ellipse at heights y; by symmetry also minus the left end at -y.
  static V side(const Splat& s, V y, float extreme) {
    const V share = y * (1.0f / s.reach_y);
    const V x = s.slope_x * y + s.half_width * vsqrt(vmax(1.0f - share * share, V{})) + 1e-3f;
    return y == broadcast(extreme) ? broadcast(s.reach_x) : x;
  }
};

}  // namespace

int64_t cover(const View& view, const Splat* splats, int64_t first, int64_t last, uint32_t* begin, Slot* out,
              int64_t room, int64_t* size) {
  const int64_t tiles = int64_t(view.tiles_x) * view.tiles_y;
  int64_t n = *size;
  int64_t i = first;
  for (; i < last && n + tiles + kTilesAtOnce <= room; i++) {
    const Splat& s = splats[i];
    begin[i] = uint32_t(n);
    const float inverse = 1.0f / kTile;
    const int y0 = within(__builtin_ceilf((s.v - s.reach_y - (kTile - 0.5f)) * inverse), view.tiles_y);
    const int y1 = within((s.v + s.reach_y - 0.5f) * inverse, view.tiles_y);
    for (int y = y0; y <= y1; y += kLanes) {
      const Rows rows(view, s, y);
      const int end = y1 - y < kLanes ? y1 - y + 1 : kLanes;
      for (int row = 0; row < end; row++) {
        const int count = rows.last[row] - rows.first[row] + 1;
        const uint32_t tile = uint32_t((y + row) * view.tiles_x + rows.first[row]);
        // More than are wanted are written at once: a loop of unknown length would be mispredicted.
        for (int k = 0; k == 0 || k < count; k += kTilesAtOnce)
          for (int l = 0; l < kTilesAtOnce; l++) out[n + k + l] = {tile + uint32_t(k + l), uint32_t(i)};
        n += count > 0 ? count : 0;
      }
    }
  }
  *size = n;
  return i;
}

}  // namespace dd::DD_ISA
