// What the kernels exchange: plain structs over raw pointers, so that one source compiles for several instruction sets
// without sharing any inline function of the standard library between them.
#pragma once
#include <cstdint>

#include "fit_types.h"
#include "sweep_types.h"

namespace dd {

constexpr int kTile = 16;                       // tile side in pixels
constexpr int kTilePixels = kTile * kTile;
constexpr int kChunk = 512;                     // Gaussians handled by one task; fixes the order of summation
constexpr float kNear = 0.2f, kFar = 1e10f;     // metres
constexpr float kBlur = 0.3f;                   // added to the projected covariance, square pixels
constexpr float kMaxAlpha = 0.999f;
constexpr float kMinAlpha = 1.0f / 255.0f;
constexpr float kMinPower = -7.99435343685886f; // log2(kMinAlpha)
constexpr float kMaxPower = -0.00144341685f;    // log2(kMaxAlpha)
constexpr float kNever = 1e30f;                 // a power that no Gaussian has
constexpr float kMinTransmittance = 1e-4f;
constexpr float kLog2e = 1.44269504088896f;
constexpr float kLn2 = 0.693147180559945f;
constexpr uint32_t kHidden = 0xffffffffu;

struct View {
  float rotation[9], translation[3];            // camera from world
  float eye[3];                                 // -R^T t
  float fx, fy, cx, cy;
  float min_tx, max_tx, min_ty, max_ty;         // limits of x/z and y/z in the Jacobian
  int width, height, tiles_x, tiles_y;
  bool antialiased;                             // opacity shrinks by what the blur adds to the area
};

struct Inputs {
  const float *means, *quaternions, *scales, *opacities, *sh;
  const float* channels;                        // (n, n_channels) or null
  const float* offsets;                         // (n, 2) or null
  int64_t n;
  int sh_stored, sh_degree, n_channels;         // coefficients stored; degree evaluated; extra channels
};

// A projected Gaussian. With dx = x - u, dy = y - v and e = conic_xx dx + conic_xy dy, alpha at pixel centre (x, y) is
// 2^(log2_opacity + along e^2 + across dy^2): the quadratic form without the cancellation of its three terms, which for
// long thin footprints are thousands of times larger than their sum.
struct alignas(64) Splat {
  float u, v, conic_xx, conic_xy, along, across, log2_opacity;
  float reach_x, reach_y;                       // half extents of alpha >= 1/255, pixels
  float slope_x, half_width;                    // at dy the row's centre is slope_x dy; its half extent at dy = 0
  float colour[3];
  float depth;
  uint32_t index;                               // of the Gaussian
};

// Sums of one Gaussian over the pixels of one tile of v = alpha dL/dalpha times powers of e and y (dy above).
struct alignas(64) EntryGradient {
  float v, v_e, v_ee, v_y, v_ey, v_yy;
  float colour[3];
  float depth;
  float absolute_u, absolute_v;                 // sums of |dL/du| and |dL/dv| over the pixels, if wanted
};

// What a Gaussian gives to the pixels of one tile: the sum and the largest of its compositing weights.
struct Contribution {
  float sum, most;
};

struct Images {
  float *colour, *alpha, *depth, *channels;     // (h, w, 3), (h, w), (h, w), (h, w, c)
};
struct ImageGradients {
  const float *colour, *alpha, *depth, *channels;
};

// What a tile's forward pass leaves for its backward pass; pixels of the tile row by row.
struct TileRecord {
  float transmittance[kTilePixels];             // what light is left behind all that a pixel took
  int32_t stop_entry[kTilePixels];              // the entries at which pixels stopped, ascending: they took no part of it,
  uint8_t stop_pixel[kTilePixels];              // the pixels that did,
  int32_t n_stops;                              // and how many
  int32_t n_reached;                            // entries that any pixel may have taken
};

// One tile's work.
struct TileTask {
  const View* view;
  const Splat* splats;                          // in depth order
  const uint32_t* entries;                      // indices into splats, in depth order
  int n_entries, tile_x, tile_y;
  const float* channels;                        // (n, n_channels) of the Gaussians
  int n_channels;
  TileRecord* record;                           // null if no gradient is wanted
  float* scratch;                               // forward: 256 c floats, backward: 256 c + 16 c
};

// One place of a splat in the tile lists.
struct Slot {
  uint32_t tile, place;                         // the tile, and the index within its list
};
constexpr int kTilesAtOnce = 4;                 // places that may be written beyond what is listed

struct Gradients {
  float *means, *quaternions, *scales, *opacities, *sh, *channels, *screen, *screen_absolute;
};

struct BackwardTask {
  const Splat* splats;
  const uint32_t* rank;                         // of each Gaussian in splats, kHidden where it reaches no tile
  const uint32_t* slot_begin;                   // per splat: its range of slots
  const Slot* slots;
  const uint32_t* reached_begin;                // per tile + 1: its range of gradients, of the entries it reached
  const EntryGradient* entry_gradients;
  const float* entry_channels;                  // (reached entries, n_channels)
  Gradients out;
};

struct SsimTask {
  const float *image, *target;                  // (h, w, 3)
  int height, width, first_row, last_row;
  float* map;                                   // (h, w, 3); not written by the loss
  float *d_mean, *d_square, *d_product;         // of the map by E[x], E[x^2], E[xy]; null if no gradient is wanted
  const float* d_map;                           // upstream gradient
  float* d_image;
  float* scratch;                               // kSsimScratchRows * ssim_row(width)
  // Of the loss alone.
  const uint8_t* mask;                          // (h, w), pixels that count
  double* sums;                                 // of |image - target| and of the similarity, over the band
  float by_difference, by_similarity;           // gradient of the loss by each of their terms
};
constexpr int kSsimRadius = 5, kSsimScratchRows = 4 * (1 + 11) + 1;
// Floats of one row with its padding, rounded up so that whole lanes may be read past the end.
static inline int ssim_row(int width) { return (3 * (width + 2 * kSsimRadius) + 31) / 16 * 16; }

// Rows [first, last) of a view that is mixed from its surroundings in several pictures.
struct MixTask {
  const float* answer;                          // (taps + details, h, w)
  const float* pictures;                        // (n, 4, h + 2 reach, w + 2 reach): RGB and how sure; the view first
  const int32_t* tap;                           // (taps, 3): picture, rows and columns away; the view's own pixel first
  const int32_t* detail;                        // (details, 2): rows and columns away in the view
  float* mixed;                                 // (3, h, w)
  int taps, details, height, width, reach, first, last;
  float own, most_detail, gentle;               // logit of the own pixel; what scales the details
};

// The same functions compiled for one instruction set.
struct Kernels {
  const char* isa;
  // Projects Gaussians [first, last), last - first <= kChunk, to projected[i]; appends depth << 32 | i of those
  // that can be seen to keys; returns how many.
  int (*project)(const Inputs&, const View&, int64_t first, int64_t last, Splat* projected, uint64_t* keys);
  // Writes every gradient row of Gaussians [first, last) and 12 sums for the pose (3 x 4, row by row).
  void (*project_backward)(const Inputs&, const View&, const BackwardTask&, int64_t first, int64_t last,
                           float* pose);
  // Lists the tiles that splats [first, last) meet, with the splat as place, from out[*size] on, and where each splat's
  // begin. Stops early when `room` may not suffice for the next one; returns the first splat that was not handled.
  int64_t (*cover)(const View&, const Splat*, int64_t first, int64_t last, uint32_t* begin, Slot* out, int64_t room,
                   int64_t* size);
  void (*composite)(const TileTask&, const Images&);
  // Writes the gradients of the entries that were reached; `absolute`: |dL/du| and |dL/dv| too.
  void (*composite_backward)(const TileTask&, const ImageGradients&, bool absolute, EntryGradient*,
                             float* entry_channels);
  // Writes the depth where a pixel is half covered (0 if never) and the contributions of the entries that were reached.
  void (*inspect)(const TileTask&, float* median, Contribution*);
  void (*ssim)(const SsimTask&);
  void (*ssim_backward)(const SsimTask&);
  void (*l1_ssim)(const SsimTask&);
  void (*l1_ssim_backward)(const SsimTask&);
  void (*over_sky)(const PictureTask&);
  void (*over_sky_backward)(const PictureTask&);
  void (*geometry_loss)(const GeometryLossTask&);
  void (*adam)(const AdamTask&);
  void (*activate)(const ActivationTask&);
  void (*activate_backward)(const ActivationTask&);
  void (*network)(const NetworkTask&);
  void (*network_backward)(const NetworkTask&);
  void (*planes)(const PlanesTask&);
  void (*planes_backward)(const PlanesTask&);
  void (*steepness)(const SteepnessTask&);  // one image
  void (*sweep_cost)(const SweepTask&);     // (h, labels, w): 1 less the mean of the two best correlations; 1 unseen
  void (*sweep_misfit)(const SweepTask&);   // (labels, h, w): mean absolute difference in grey levels
  void (*smooth)(const SmoothTask&);
  void (*weighted_median)(const MedianTask&);
  void (*mix)(const MixTask&);
};

const Kernels& kernels();                       // the set chosen at run time

}  // namespace dd
