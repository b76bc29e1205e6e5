#include "rasterize.h"

#include <algorithm>
#include <chrono>
#include <mutex>
#include <vector>

#include "after_fork.h"
#include "threads.h"

namespace dd {
namespace {

constexpr size_t kIdleFrames = 2;

// Memory that a pass needs only while it runs: one pass at a time works, as the threads are shared anyway.
struct Workspace {
  std::mutex mutex;
  Buffer<Splat> projected;
  Buffer<uint64_t> keys, spare_keys;
  TileBinner binner;
  Buffer<EntryGradient> entry_gradients;
  Buffer<float> entry_channels, scratch;
};
struct Store {
  std::mutex mutex;
  std::vector<std::unique_ptr<Frame>> idle;
  Store() { idle.reserve(kIdleFrames); }  // frames are returned where nothing may throw
};

struct Shared {
  Workspace workspace;
  Store store;
  std::mutex seconds_mutex;
  StageSeconds seconds;
  static Shared* after_fork(const Shared&) { return new Shared(); }
};
Shared& shared() { return ForkSafe<Shared>::get(); }
Workspace& workspace() { return shared().workspace; }
Store& store() { return shared().store; }

// Notes how long it lived.
class Stopwatch {
 public:
  explicit Stopwatch(double StageSeconds::* stage) : stage_(stage), start_(std::chrono::steady_clock::now()) {}
  ~Stopwatch() {
    const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start_;
    std::lock_guard<std::mutex> lock(shared().seconds_mutex);
    shared().seconds.*stage_ = taken.count();
  }

 private:
  double StageSeconds::* stage_;
  std::chrono::steady_clock::time_point start_;
};

int64_t chunks_of(int64_t n) { return (n + kChunk - 1) / kChunk; }

// Projects all Gaussians and leaves the keys of those that can be seen in work.keys; none is visible yet.
void project(const Inputs& in, Frame& frame, Workspace& work, uint8_t* visible) {
  const Stopwatch watch(&StageSeconds::project);
  const int64_t chunks = chunks_of(in.n);
  Splat* projected = work.projected.resize(in.n);
  uint64_t *sparse = work.spare_keys.resize(in.n), *keys = work.keys.resize(in.n);
  uint32_t* rank = frame.rank.resize(in.n);
  std::vector<int64_t> begin(chunks + 1, 0);
  parallel_for(chunks, [&](int64_t chunk, int) {
    const int64_t first = chunk * kChunk, last = std::min(in.n, first + kChunk);
    std::fill(rank + first, rank + last, kHidden);
    std::fill(visible + first, visible + last, uint8_t(0));
    begin[chunk + 1] = kernels().project(in, frame.view, first, last, projected, sparse + first);
  });
  for (int64_t chunk = 0; chunk < chunks; chunk++) {
    std::copy_n(sparse + chunk * kChunk, begin[chunk + 1], keys + begin[chunk]);
    begin[chunk + 1] += begin[chunk];
  }
  frame.n_splats = begin[chunks];
}

// Leaves the splats in frame.splats in depth order; equal depths keep index order.
void sort(Frame& frame, Workspace& work) {
  const Stopwatch watch(&StageSeconds::sort);
  uint64_t* keys = work.keys.data();
  sort_by_depth(keys, work.spare_keys.data(), frame.n_splats);
  Splat* splats = frame.splats.resize(frame.n_splats);
  parallel_for(chunks_of(frame.n_splats), [&](int64_t chunk, int) {
    const int64_t last = std::min(frame.n_splats, (chunk + 1) * kChunk);
    for (int64_t i = chunk * kChunk; i < last; i++) splats[i] = work.projected[uint32_t(keys[i])];
  });
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
  task.record = keep ? frame.records.data() + tile : nullptr;
  task.scratch = nullptr;
  return task;
}

int64_t tile_count(const Frame& frame) { return int64_t(frame.view.tiles_x) * frame.view.tiles_y; }
// Per tile + 1: the range of the entries it reached, when only those are stored one after another.
std::vector<uint32_t> begin_of_reached(const Frame& frame) {
  std::vector<uint32_t> begin(tile_count(frame) + 1, 0);
  for (int64_t tile = 0; tile < tile_count(frame); tile++)
    begin[tile + 1] = begin[tile] + uint32_t(frame.records[tile].n_reached);
  return begin;
}

int64_t scratch_floats(const Inputs& in) { return int64_t(kTilePixels + kTile) * in.n_channels; }

}  // namespace

StageSeconds stage_seconds() {
  std::lock_guard<std::mutex> lock(shared().seconds_mutex);
  return shared().seconds;
}

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

View make_view(const float m[16], float fx, float fy, float cx, float cy, int width, int height,
               bool antialiased) {
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
  v.antialiased = antialiased;
  return v;
}

void render_forward(const Inputs& in, Frame& frame, bool keep, const Images& out, uint8_t* visible) {
  Workspace& work = workspace();
  std::lock_guard<std::mutex> lock(work.mutex);
  frame.n = in.n;
  project(in, frame, work, visible);
  sort(frame, work);
  {
    const Stopwatch watch(&StageSeconds::tiles);
    work.binner.bin(frame.view, frame.splats.data(), frame.n_splats, keep, frame.lists, frame.rank.data(), visible);
  }
  const int64_t tiles = tile_count(frame), scratch = scratch_floats(in);
  if (keep) frame.records.resize(tiles);
  const int workers = thread_count();
  work.scratch.resize(workers * scratch);
  const Stopwatch watch(&StageSeconds::composite);
  const auto run = [&](int64_t tile, int worker) {
    TileTask task = tile_task(in, frame, tile, keep);
    task.scratch = work.scratch.data() + worker * scratch;
    kernels().composite(task, out);
  };
  parallel_for(tiles, run, workers);
}

void render_inspect(const Inputs& in, Frame& frame, float* median, float* weight_sum, float* weight_most) {
  const std::vector<uint32_t> begin = begin_of_reached(frame);
  Buffer<Contribution> contributions;
  contributions.resize(begin.back());
  parallel_for(tile_count(frame), [&](int64_t tile, int) {
    kernels().inspect(tile_task(in, frame, tile, true), median, contributions.data() + begin[tile]);
  });
  parallel_for(chunks_of(in.n), [&](int64_t chunk, int) {
    for (int64_t i = chunk * kChunk, last = std::min(in.n, i + kChunk); i < last; i++) {
      weight_sum[i] = weight_most[i] = 0;
      const uint32_t rank = frame.rank[i];
      if (rank == kHidden) continue;
      for (uint32_t k = frame.lists.slot_begin[rank]; k < frame.lists.slot_begin[rank + 1]; k++) {
        const Slot slot = frame.lists.slots[k];
        if (begin[slot.tile] + slot.place >= begin[slot.tile + 1]) continue;
        const Contribution& part = contributions[begin[slot.tile] + slot.place];
        weight_sum[i] += part.sum;
        weight_most[i] = std::max(weight_most[i], part.most);
      }
    }
  });
}

void render_backward(const Inputs& in, Frame& frame, const ImageGradients& upstream, const Gradients& out,
                     float pose[16]) {
  Workspace& work = workspace();
  std::lock_guard<std::mutex> lock(work.mutex);
  const int64_t tiles = tile_count(frame), scratch = scratch_floats(in), chunks = chunks_of(in.n);
  const std::vector<uint32_t> reached_begin = begin_of_reached(frame);
  EntryGradient* entry_gradients = work.entry_gradients.resize(reached_begin[tiles]);
  float* entry_channels = work.entry_channels.resize(size_t(reached_begin[tiles]) * in.n_channels);
  const int workers = thread_count();
  work.scratch.resize(workers * scratch);
  {
    const Stopwatch watch(&StageSeconds::composite_backward);
    const auto run = [&](int64_t tile, int worker) {
      TileTask task = tile_task(in, frame, tile, true);
      task.scratch = work.scratch.data() + worker * scratch;
      kernels().composite_backward(task, upstream, out.screen_absolute, entry_gradients + reached_begin[tile],
                                   entry_channels + size_t(reached_begin[tile]) * in.n_channels);
    };
    parallel_for(tiles, run, workers);
  }
  const Stopwatch watch(&StageSeconds::project_backward);
  const BackwardTask task = {frame.splats.data(),  frame.rank.data(), frame.lists.slot_begin.data(),
                             frame.lists.slots.data(), reached_begin.data(), entry_gradients, entry_channels, out};
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
