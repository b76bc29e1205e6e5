// What the kernels of a training step exchange, beside the splatting ones in types.h.
#pragma once
#include <cstdint>

namespace dd {

// Gaussians [first, last) made ready for splatting: exp and sigmoid taken, written from row `to` on; and back.
// Means are `means`, or with offsets means + unit * offsets.
struct ActivationTask {
  const float *means, *unit, *offsets;          // (n, 3), (n), (n, 3); unit and offsets null together
  const float *quaternions, *log_scales, *logits, *sh;
  int64_t first, last, to;
  int sh_size;                                  // floats of one Gaussian's colour
  float *out_means, *out_quaternions, *scales, *opacities, *out_sh;  // of all parts
  const float *d_means, *d_scales, *d_opacities;                    // of all parts
  float *d_offsets, *d_log_scales, *d_logits;                       // of this part; d_offsets null without offsets
};

// Pixels [first, last) of a picture: the splatted colour over the sky, seen through the camera's exposure.
struct PictureTask {
  const float *colour, *alpha, *sky;            // (pixels, 3), (pixels), (pixels, 3)
  const float* affine;                          // (3, 4)
  int64_t first, last;
  float* picture;                               // (pixels, 3)
  const float* d_picture;
  float *d_colour, *d_alpha;
  double* d_affine;                             // (3, 4), sums over these pixels
};

// Pixels [first, last) of the loss on depth and coverage; gradients are those of the terms below.
struct GeometryLossTask {
  const float *depth_sum, *alpha, *reference, *weight;
  const uint8_t* sky;
  int64_t first, last;
  double* sums;                                 // of weight |alpha / depth_sum - 1 / reference|, and of alpha in the sky
  float by_disparity, by_coverage;              // gradient of the loss by each of their terms
  float *d_depth_sum, *d_alpha;                 // null if no gradient is wanted
};
constexpr float kLeastCover = 1e-3f;            // floor of alpha, of composited depth and of reference depth in the above

// One tensor's part of an Adam step, torch.optim.Adam's formula: elements [first, last), first a multiple of
// columns * kLanes.
struct AdamTask {
  float* value;
  const float* gradient;
  float *mean, *square;                         // running means of the gradient and of its square
  const float* rates;                           // step size of each column
  int64_t first, last;
  int columns;                                  // at most kMostColumns
  float new_mean, keep_square, new_square;      // 1 - beta1, beta2, 1 - beta2
  float epsilon;
  float scale_mean, scale_root;                 // 1 / (1 - beta1^t), 1 / sqrt(1 - beta2^t)
};
constexpr int kMostColumns = 64;

// A network of dense layers with ReLU on the positional encoding of a point and a time, or on numbers given for a point.
// While it is worked on, a point has a row of values: what the network reads, then the outputs of each hidden layer. Each
// of these stretches is padded with zeros.
constexpr int kPad = 16;                        // floats, and rows
constexpr int kNetworkRows = 96;                // points that are worked on together
constexpr int kMostOctaves = 32;
static inline int padded(int count) { return (count + kPad - 1) / kPad * kPad; }
struct NetworkShape {
  int depth, width, last, outputs;              // hidden layers, units of each, of the last, numbers that come out
  int position_octaves, time_code;              // of the encoding of a position; floats of the encoded time
  int skip;                                     // hidden layer that reads the encoding again, -1 for none
  int given;                                    // numbers of a point that are read instead of an encoding, 0 for none
  int encoded() const { return given ? given : 3 * (1 + 2 * position_octaves) + time_code; }
  int row() const { return padded(encoded()) + (depth - 1) * padded(width) + padded(last); }
  int most() const { return row() + padded(outputs); }  // of any layer's outputs
  int scratch() const { return kNetworkRows * (row() + 2 * most()); }
};

// A hidden layer, or for index = depth the heads side by side. Its packed weights are the matrices of its stretches
// (inputs x outputs), then the bias.
struct NetworkLayer {
  struct Stretch {
    int at, inputs;                             // where in the row of values
  };
  int outputs, stretches;
  Stretch stretch[2];                           // the encoding, the values of the layer before, or both
  Stretch near() const { return stretch[stretches - 1]; }  // what the layer before wrote
  int inputs() const { return stretch[0].inputs + (stretches > 1 ? stretch[1].inputs : 0); }
  int weights() const { return (inputs() + 1) * outputs; }
};
static inline NetworkLayer network_layer(const NetworkShape& shape, int index) {
  const int width = padded(shape.width), encoded = padded(shape.encoded());
  const int outputs = index == shape.depth ? shape.outputs : index == shape.depth - 1 ? shape.last : shape.width;
  NetworkLayer layer = {padded(outputs), 0, {}};
  if (index == 0 || index == shape.skip) layer.stretch[layer.stretches++] = {0, encoded};
  const int before = index == shape.depth ? padded(shape.last) : width;
  if (index > 0) layer.stretch[layer.stretches++] = {encoded + (index - 1) * width, before};
  return layer;
}

struct NetworkTask {
  NetworkShape shape;
  const float *means, *centre, *time_code;      // (n, 3), (3), (time_code): what is encoded,
  float radius;
  const float* given;                           // or (n, given)
  const float* weights;                         // packed, layer by layer
  const int64_t* points;                        // which of the n
  int count;                                    // of them, at most kNetworkRows
  float* out;                                   // (n, outputs)
  const float* transposed;                      // (outputs x inputs) of each layer from the last, see passes_on
  const float* d_out;                           // (n, outputs)
  float* d_weights;                             // packed; added to
  float* d_given;                               // (n, given) or null
  float* scratch;                               // shape.scratch() floats
};
// Whether a layer hands gradients to what it reads: an encoding takes none.
static inline bool passes_on(const NetworkShape& shape, int index) { return index > 0 || shape.given > 0; }

// Eight neighbouring channels of one level of a hexplane at points [first, last): the product of what six planes hold.
constexpr int kPlaneSlice = 8;                  // channels, side by side at each node
struct PlanesTask {
  const float *means, *low, *high;              // (n, 3) and the corners of the box (3)
  int64_t first, last;
  int nodes;                                    // along each axis of space
  int channels;                                 // of the slice that are used
  const float* space;                           // (3, nodes, nodes, kPlaneSlice): xy, xz, yz, the first named axis last
  const float* lines;                           // (3, nodes, kPlaneSlice): xt, yt, zt at the time
  int64_t row;                                  // floats from one point's features to the next one's
  float* features;                              // of the slice
  const float* d_features;
  float *d_space, *d_lines;                     // added to
};

// The squared differences of neighbours in a square image of nodes, along both axes.
struct SteepnessTask {
  const float* image;                           // (nodes, nodes)
  int nodes;
  float by_sum;                                 // gradient of the result by the sum
  float* d_image;                               // null if no gradient is wanted
  double* sum;
  float* scratch;                               // 3 steepness_row(nodes) zeros
};
static inline int steepness_row(int nodes) { return padded(nodes + 1); }

}  // namespace dd
