// Renders a scene in float64, pixel by pixel, and counts as JSON the work that any tile renderer has to do.
//
//     g++ -O3 -march=native -std=c++17 -o work work.cpp && ./work scene.bin image.bin LANES
//
// The rules are those of the library (16 x 16 tiles, nothing below alpha 1/255, nobody may take the transmittance to 1e-4),
// but lists and rows are exact: a tile lists a Gaussian only if alpha >= 1/255 somewhere in its rectangle of pixel
// centres, and a row of LANES pixels counts only if a pixel of it that has not stopped sees alpha >= 1/255.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <vector>

namespace {

constexpr int kTile = 16;
constexpr double kNear = 0.2, kBlur = 0.3, kMinAlpha = 1.0 / 255, kMaxAlpha = 0.999, kMinTransmittance = 1e-4;

struct Scene {
  int n = 0, width = 0, height = 0;
  float fx, fy, cx, cy, view[16];
  std::vector<float> means, quaternions, scales, opacities, colours;
};

bool read(FILE* file, std::vector<float>& values, size_t count) {
  values.resize(count);
  return std::fread(values.data(), sizeof(float), count, file) == count;
}

bool read(const char* path, Scene& s) {
  FILE* file = std::fopen(path, "rb");
  if (!file) return false;
  int sizes[3];
  float lens[4];
  bool good = std::fread(sizes, 4, 3, file) == 3 && std::fread(lens, 4, 4, file) == 4 &&
              std::fread(s.view, 4, 16, file) == 16;
  if (good) {
    s.n = sizes[0], s.width = sizes[1], s.height = sizes[2];
    s.fx = lens[0], s.fy = lens[1], s.cx = lens[2], s.cy = lens[3];
    const size_t n = size_t(s.n);
    good = read(file, s.means, 3 * n) && read(file, s.quaternions, 4 * n) && read(file, s.scales, 3 * n) &&
           read(file, s.opacities, n) && read(file, s.colours, 3 * n);
  }
  std::fclose(file);
  return good;
}

// A footprint; form(dx, dy) = (xx dx^2 + yy dy^2) / 2 + xy dx dy, alpha = opacity exp(-form), at least 1/255 if form <= limit.
struct Footprint {
  double u, v, xx, xy, yy, limit, opacity, reach_x, reach_y, depth;
  const float* colour;
  double form(double dx, double dy) const { return 0.5 * (xx * dx * dx + yy * dy * dy) + xy * dx * dy; }
};

// Least value of the form over a rectangle of offsets.
double least(const Footprint& f, double x0, double x1, double y0, double y1) {
  if (x0 <= 0 && x1 >= 0 && y0 <= 0 && y1 >= 0) return 0;
  double best = 1e300;
  for (double x : {x0, x1}) best = std::min(best, f.form(x, std::clamp(-f.xy * x / f.yy, y0, y1)));
  for (double y : {y0, y1}) best = std::min(best, f.form(std::clamp(-f.xy * y / f.xx, x0, x1), y));
  return best;
}

void rotation_of(const float* quaternion, double out[3][3]) {
  double w = quaternion[0], x = quaternion[1], y = quaternion[2], z = quaternion[3];
  const double norm = std::sqrt(w * w + x * x + y * y + z * z);
  w /= norm, x /= norm, y /= norm, z /= norm;
  const double rows[3][3] = {{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)},
                             {2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)},
                             {2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)}};
  for (int r = 0; r < 3; r++)
    for (int k = 0; k < 3; k++) out[r][k] = rows[r][k];
}

// False if the Gaussian cannot reach a pixel centre.
bool project(const Scene& s, int i, Footprint& f) {
  double camera[3], rotation[3][3];
  for (int r = 0; r < 3; r++) {
    camera[r] = s.view[4 * r + 3];
    for (int k = 0; k < 3; k++) camera[r] += double(s.view[4 * r + k]) * s.means[3 * i + k];
  }
  f.depth = camera[2], f.opacity = s.opacities[i], f.colour = &s.colours[3 * i];
  if (camera[2] < kNear || f.opacity < kMinAlpha) return false;
  rotation_of(&s.quaternions[4 * i], rotation);
  const double x = camera[0] / camera[2], y = camera[1] / camera[2], margin_x = 0.15 * s.width, margin_y = 0.15 * s.height;
  const double tx = std::clamp(x, -(s.cx + margin_x) / s.fx, (s.width - s.cx + margin_x) / s.fx);
  const double ty = std::clamp(y, -(s.cy + margin_y) / s.fy, (s.height - s.cy + margin_y) / s.fy);
  double cov_xx = kBlur, cov_xy = 0, cov_yy = kBlur;
  for (int k = 0; k < 3; k++) {
    double row[3] = {0, 0, 0};  // camera rotation times rotation times scale, column k
    for (int r = 0; r < 3; r++)
      for (int j = 0; j < 3; j++) row[r] += s.view[4 * r + j] * rotation[j][k] * s.scales[3 * i + k];
    const double a = s.fx / camera[2] * (row[0] - tx * row[2]), b = s.fy / camera[2] * (row[1] - ty * row[2]);
    cov_xx += a * a, cov_xy += a * b, cov_yy += b * b;
  }
  const double determinant = cov_xx * cov_yy - cov_xy * cov_xy;
  f.u = s.fx * x + s.cx, f.v = s.fy * y + s.cy;
  f.xx = cov_yy / determinant, f.xy = -cov_xy / determinant, f.yy = cov_xx / determinant;
  f.limit = std::log(f.opacity / kMinAlpha);
  f.reach_x = std::sqrt(2 * f.limit * cov_xx), f.reach_y = std::sqrt(2 * f.limit * cov_yy);
  return f.u + f.reach_x >= 0.5 && f.u - f.reach_x <= s.width - 0.5 && f.v + f.reach_y >= 0.5 &&
         f.v - f.reach_y <= s.height - 0.5;
}

struct Counts {
  int64_t in_view = 0, entries = 0, reached = 0, boxed_rows = 0, rows = 0, pairs = 0;
};

// Tiles [first, last] along one axis whose pixel centres meet [low, high].
int first_tile(double low) { return std::max(0, int(std::ceil((low - (kTile - 0.5)) / kTile))); }
int last_tile(double high, int count) { return std::min(count - 1, int(std::floor((high - 0.5) / kTile))); }

std::vector<std::vector<int>> tile_lists(const Scene& s, const std::vector<Footprint>& footprints) {
  const int tiles_x = (s.width + kTile - 1) / kTile, tiles_y = (s.height + kTile - 1) / kTile;
  std::vector<std::vector<int>> lists(size_t(tiles_x) * tiles_y);
  for (int i = 0; i < int(footprints.size()); i++) {
    const Footprint& f = footprints[i];
    const int x1 = last_tile(f.u + f.reach_x, tiles_x), y1 = last_tile(f.v + f.reach_y, tiles_y);
    for (int ty = first_tile(f.v - f.reach_y); ty <= y1; ty++)
      for (int tx = first_tile(f.u - f.reach_x); tx <= x1; tx++) {
        const int right = std::min(s.width, (tx + 1) * kTile), bottom = std::min(s.height, (ty + 1) * kTile);
        const double best = least(f, tx * kTile + 0.5 - f.u, right - 0.5 - f.u, ty * kTile + 0.5 - f.v,
                                  bottom - 0.5 - f.v);
        if (best <= f.limit) lists[size_t(ty) * tiles_x + tx].push_back(i);
      }
  }
  return lists;
}

// One tile's pixels while it is composited.
struct Tile {
  int x0, y0, width, height, alive;
  double transmittance[kTile][kTile], colour[kTile][kTile][3];
  bool stopped[kTile][kTile];
  int alive_in[kTile][kTile];  // pixels of a row, strip by strip

  Tile(int x, int y, const Scene& s, int lanes)
      : x0(x), y0(y), width(std::min(kTile, s.width - x)), height(std::min(kTile, s.height - y)), alive(width * height) {
    for (int row = 0; row < kTile; row++)
      for (int column = 0; column < kTile; column++) {
        transmittance[row][column] = 1;
        stopped[row][column] = row >= height || column >= width;
        for (double& part : colour[row][column]) part = 0;
        alive_in[row][column] = 0;
      }
    for (int row = 0; row < height; row++)
      for (int column = 0; column < width; column++) alive_in[row][column / lanes]++;
  }
};

// One strip of a row; returns whether any pixel of it sees the Gaussian.
bool blend(Tile& tile, const Footprint& f, int row, int strip, int lanes, Counts& counts) {
  bool seen = false;
  const int end = std::min(tile.width, (strip + 1) * lanes);
  for (int column = strip * lanes; column < end; column++) {
    if (tile.stopped[row][column]) continue;
    const double form = f.form(tile.x0 + column + 0.5 - f.u, tile.y0 + row + 0.5 - f.v);
    if (form > f.limit) continue;
    seen = true;
    double& before = tile.transmittance[row][column];
    const double alpha = std::min(kMaxAlpha, f.opacity * std::exp(-form)), after = before * (1 - alpha);
    if (after <= kMinTransmittance) {
      tile.stopped[row][column] = true;
      tile.alive_in[row][strip]--;
      tile.alive--;
      continue;
    }
    for (int c = 0; c < 3; c++) tile.colour[row][column][c] += before * alpha * f.colour[c];
    before = after;
    counts.pairs++;
  }
  return seen;
}

void composite(Tile& tile, const std::vector<Footprint>& footprints, const std::vector<int>& list, int lanes,
               Counts& counts) {
  for (int i : list) {
    if (!tile.alive) return;
    counts.reached++;
    const Footprint& f = footprints[i];
    const double top = f.v - f.reach_y - tile.y0 - 0.5, left = f.u - f.reach_x - tile.x0 - 0.5;
    const int row0 = std::max(0, int(std::ceil(top))), column0 = std::max(0, int(std::ceil(left)));
    const int row1 = std::min(tile.height - 1, int(std::floor(top + 2 * f.reach_y)));
    const int column1 = std::min(tile.width - 1, int(std::floor(left + 2 * f.reach_x)));
    for (int row = row0; row <= row1; row++)
      for (int strip = column0 / lanes; strip * lanes <= column1; strip++) {
        if (!tile.alive_in[row][strip]) continue;
        counts.boxed_rows++;
        counts.rows += blend(tile, f, row, strip, lanes, counts);
      }
  }
}

}  // namespace

int main(int n, char** arguments) {
  Scene s;
  if (n != 4 || !read(arguments[1], s)) {
    std::fprintf(stderr, "usage: work SCENE.bin IMAGE.bin LANES\n");
    return 1;
  }
  const int lanes = std::atoi(arguments[3]);
  Counts counts;
  std::vector<Footprint> footprints;
  for (int i = 0; i < s.n; i++) {
    Footprint f;
    if (project(s, i, f)) footprints.push_back(f);
  }
  counts.in_view = int64_t(footprints.size());
  std::stable_sort(footprints.begin(), footprints.end(),
                   [](const Footprint& a, const Footprint& b) { return a.depth < b.depth; });
  const auto lists = tile_lists(s, footprints);
  const int tiles_x = (s.width + kTile - 1) / kTile;
  std::vector<float> image(size_t(3) * s.width * s.height);
  for (size_t t = 0; t < lists.size(); t++) {
    counts.entries += int64_t(lists[t].size());
    Tile tile(int(t % tiles_x) * kTile, int(t / tiles_x) * kTile, s, lanes);
    composite(tile, footprints, lists[t], lanes, counts);
    for (int row = 0; row < tile.height; row++)
      for (int column = 0; column < tile.width; column++)
        for (int c = 0; c < 3; c++)
          image[3 * (size_t(tile.y0 + row) * s.width + tile.x0 + column) + c] = float(tile.colour[row][column][c]);
  }
  FILE* out = std::fopen(arguments[2], "wb");
  if (!out || std::fwrite(image.data(), 4, image.size(), out) != image.size()) return 1;
  std::fclose(out);
  std::printf("{\"in_view\": %ld, \"entries\": %ld, \"reached\": %ld, \"boxed_rows\": %ld, \"rows\": %ld, \"pairs\": %ld, "
              "\"lanes\": %d}\n",
              long(counts.in_view), long(counts.entries), long(counts.reached), long(counts.boxed_rows),
              long(counts.rows), long(counts.pairs), lanes);
}
