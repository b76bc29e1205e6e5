// Splatting of one view: projection, depth order, tiles, compositing; and back.
#pragma once
#include <memory>

#include "buffer.h"
#include "kernels/types.h"
#include "tiles.h"

namespace dd {

// What one forward pass leaves for its backward pass, with the memory it worked in.
struct Frame {
  View view;
  int64_t n = 0, n_splats = 0;
  Buffer<Splat> splats;      // of those that can be seen, in depth order
  Buffer<uint32_t> rank;     // of each Gaussian in splats, kHidden where it reaches no tile
  TileLists lists;
  Buffer<TileRecord> records;
};

// Frames are returned to a small store when dropped, so that their memory is used again.
struct FrameReturner {
  void operator()(Frame* frame) const;
};
using FrameHandle = std::unique_ptr<Frame, FrameReturner>;
FrameHandle take_frame();

View make_view(const float camera_from_world[16], float fx, float fy, float cx, float cy, int width, int height,
               bool antialiased);

// Writes the images and visible (n); keeps what the backward pass needs if `keep`.
void render_forward(const Inputs& in, Frame& frame, bool keep, const Images& out, uint8_t* visible);

// After render_forward with `keep`: median depth (h, w), 0 where a pixel is never half covered, and per Gaussian (n) the
// sum and the largest of its weights in the image.
void render_inspect(const Inputs& in, Frame& frame, float* median, float* weight_sum, float* weight_most);

// Seconds that the parts of the most recent forward and backward passes took.
struct StageSeconds {
  double project = 0, sort = 0, tiles = 0, composite = 0, composite_backward = 0, project_backward = 0;
};
StageSeconds stage_seconds();

// Writes every gradient that is not null, and the pose's (4 x 4, last row zero).
void render_backward(const Inputs& in, Frame& frame, const ImageGradients& upstream, const Gradients& out,
                     float pose[16]);

}  // namespace dd
