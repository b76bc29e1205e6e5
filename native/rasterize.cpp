#include "rasterize.h"

#include <algorithm>
#include <mutex>
#include <vector>

#include "threads.h"

namespace dd {
namespace {

constexpr size_t kIdleFrames = 3;

struct Store {
  std::mutex mutex;
  std::vector<std::unique_ptr<Frame>> idle;
};
Store& store() {
  static Store* s = new Store();  // never destroyed: frames may outlive the module's statics
  return *s;
}

int64_t chunks_of(int64_t n) { return (n + kChunk - 1) / kChunk; }

// Projects all Gaussians and leaves those that can be seen in frame.splats, in depth order; equal depths keep index order.
void project_and_sort(const Inputs& in, Frame& frame) {
  const int64_t chunks = chunks_of(in.n);
  Splat* projected = frame.projected.resize(in.n);
  uint64_t *sparse = frame.spare_keys.resize(in.n), *keys = frame.keys.resize(in.n);
  std::vector<int64_t> begin(chunks + 1, 0);
  parallel_for(chunks, [&](int64_t chunk, int) {
    const int64_t first = chunk * kChunk;
    begin[chunk + 1] =
        kernels().project(in, frame.view, first, std::min(in.n, first + kChunk), projected, sparse + first);
  });
  for (int64_t chunk = 0; chunk < chunks; chunk++) {
    std::copy_n(sparse + chunk * kChunk, begin[chunk + 1], keys + begin[chunk]);
    begin[chunk + 1] += begin[chunk];
  }
  frame.n_splats = begin[chunks];
  sort_by_depth(keys, sparse, frame.n_splats);
  Splat* splats = frame.splats.resize(frame.n_splats);
  parallel_for(chunks_of(frame.n_splats), [&](int64_t chunk, int) {
    const int64_t last = std::min(frame.n_splats, (chunk + 1) * kChunk);
    for (int64_t i = chunk * kChunk; i < last; i++) splats[i] = projected[uint32_t(keys[i])];
  });
}

// rank of each Gaussian among the splats, and whether it reaches a tile.
void mark_visible(Frame& frame, uint8_t* visible) {
  uint32_t* rank = frame.rank.resize(frame.n);
  std::fill_n(rank, frame.n, kHidden);
  std::fill_n(visible, frame.n, uint8_t(0));
  for (int64_t i = 0; i < frame.n_splats; i++) {
    if (frame.lists.slot_begin[i] == frame.lists.slot_begin[i + 1]) continue;
    const uint32_t index = frame.splats[i].index;
    rank[index] = uint32_t(i);
    visible[index] = 1;
  }
}

TileTask tile_task(const Inputs& in, Frame& frame, int64_t tile, bool keep) {
  const uint32_t begin = frame.lists.tile_begin[tile];
  TileTask task;
  task.view = &frame.view;
  task.splats = frame.splats.data();
  task.entries = frame.lists.entries.data() + begin;
  task.n_entries = int(frame.lists.tile_begin[tile + 1] - begin);
  task.tile_x = int(tile % frame.view.tiles_x);
  task.tile_y = int(tile / frame.view.tiles_x);
  task.channels = in.channels;
  task.n_channels = in.n_channels;
  task.transmittance = keep ? frame.transmittance.data() + tile * kTilePixels : nullptr;
  task.last = keep ? frame.last.data() + tile * kTilePixels : nullptr;
  task.scratch = nullptr;
  return task;
}

int64_t tile_count(const Frame& frame) { return int64_t(frame.view.tiles_x) * frame.view.tiles_y; }
int64_t scratch_floats(const Inputs& in) { return int64_t(kTilePixels + kTile) * in.n_channels; }

}  // namespace

void FrameReturner::operator()(Frame* frame) const {
  std::unique_ptr<Frame> owned(frame);
  std::lock_guard<std::mutex> lock(store().mutex);
  if (store().idle.size() < kIdleFrames) store().idle.push_back(std::move(owned));
}

FrameHandle take_frame() {
  std::lock_guard<std::mutex> lock(store().mutex);
  if (store().idle.empty()) return FrameHandle(new Frame());
  FrameHandle frame(store().idle.back().release());
  store().idle.pop_back();
  return frame;
}

View make_view(const float m[16], float fx, float fy, float cx, float cy, int width, int height) {
  View v;
  for (int row = 0; row < 3; row++) {
    for (int k = 0; k < 3; k++) v.rotation[3 * row + k] = m[4 * row + k];
    v.translation[row] = m[4 * row + 3];
  }
  for (int k = 0; k < 3; k++)
    v.eye[k] = -(m[k] * v.translation[0] + m[4 + k] * v.translation[1] + m[8 + k] * v.translation[2]);
  v.fx = fx;
  v.fy = fy;
  v.cx = cx;
  v.cy = cy;
  // gsplat: the image widened by 15 % of its size on either side.
  v.min_tx = -(cx + 0.15f * float(width)) / fx;
  v.max_tx = (float(width) - cx + 0.15f * float(width)) / fx;
  v.min_ty = -(cy + 0.15f * float(height)) / fy;
  v.max_ty = (float(height) - cy + 0.15f * float(height)) / fy;
  v.width = width;
  v.height = height;
  v.tiles_x = (width + kTile - 1) / kTile;
  v.tiles_y = (height + kTile - 1) / kTile;
  return v;
}

void render_forward(const Inputs& in, Frame& frame, bool keep, const Images& out, uint8_t* visible) {
  frame.n = in.n;
  project_and_sort(in, frame);
  frame.binner.bin(frame.view, frame.splats.data(), frame.n_splats, frame.lists);
  mark_visible(frame, visible);
  const int64_t tiles = tile_count(frame), scratch = scratch_floats(in);
  if (keep) {
    frame.transmittance.resize(tiles * kTilePixels);
    frame.last.resize(tiles * kTilePixels);
  }
  frame.scratch.resize(thread_count() * scratch);
  parallel_for(tiles, [&](int64_t tile, int worker) {
    TileTask task = tile_task(in, frame, tile, keep);
    task.scratch = frame.scratch.data() + worker * scratch;
    kernels().composite(task, out);
  });
}

void render_backward(const Inputs& in, Frame& frame, const ImageGradients& upstream, const Gradients& out,
                     float pose[16]) {
  static std::mutex mutex;  // the work space below is shared by all frames
  static Buffer<EntryGradient>& entry_gradients = *new Buffer<EntryGradient>();
  static Buffer<float>& entry_channels = *new Buffer<float>();
  std::lock_guard<std::mutex> lock(mutex);
  entry_gradients.resize(frame.lists.n_entries);
  entry_channels.resize(frame.lists.n_entries * in.n_channels);
  const int64_t scratch = scratch_floats(in), chunks = chunks_of(in.n);
  frame.scratch.resize(thread_count() * scratch);
  parallel_for(tile_count(frame), [&](int64_t tile, int worker) {
    TileTask task = tile_task(in, frame, tile, true);
    task.scratch = frame.scratch.data() + worker * scratch;
    const int64_t begin = frame.lists.tile_begin[tile];
    kernels().composite_backward(task, upstream, entry_gradients.data() + begin,
                                 entry_channels.data() + begin * in.n_channels);
  });
  const BackwardTask task = {frame.splats.data(),      frame.rank.data(),      frame.lists.slot_begin.data(),
                             frame.lists.slots.data(), entry_gradients.data(), entry_channels.data(), out};
  std::vector<float> pose_of_chunk(12 * chunks);
  parallel_for(chunks, [&](int64_t chunk, int) {
    const int64_t first = chunk * kChunk;
    kernels().project_backward(in, frame.view, task, first, std::min(in.n, first + kChunk), &pose_of_chunk[12 * chunk]);
  });
  double sums[12] = {};
  for (int64_t chunk = 0; chunk < chunks; chunk++)
    for (int k = 0; k < 12; k++) sums[k] += pose_of_chunk[12 * chunk + k];
  for (int k = 0; k < 16; k++) pose[k] = k < 12 ? float(sums[k]) : 0.0f;
}

}  // namespace dd
