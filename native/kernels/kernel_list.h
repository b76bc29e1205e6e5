// Declarations of the kernels of one instruction set; the macro DD_ISA names it.
#pragma once
#include "types.h"

namespace dd::DD_ISA {

int project(const Inputs&, const View&, int64_t first, int64_t last, Splat* projected, uint64_t* keys);
void project_backward(const Inputs&, const View&, const BackwardTask&, int64_t first, int64_t last, float* pose);
int64_t cover(const View&, const Splat*, int64_t first, int64_t last, uint32_t* begin, Slot* out, int64_t room,
              int64_t* size);
void composite(const TileTask&, const Images&);
void composite_backward(const TileTask&, const ImageGradients&, bool absolute, EntryGradient*, float* entry_channels);
void inspect(const TileTask&, float* median, Contribution*);
void ssim(const SsimTask&);
void ssim_backward(const SsimTask&);
void l1_ssim(const SsimTask&);
void l1_ssim_backward(const SsimTask&);
void over_sky(const PictureTask&);
void over_sky_backward(const PictureTask&);
void geometry_loss(const GeometryLossTask&);
void adam(const AdamTask&);
void activate(const ActivationTask&);
void activate_backward(const ActivationTask&);
void network(const NetworkTask&);
void network_backward(const NetworkTask&);
void planes(const PlanesTask&);
void planes_backward(const PlanesTask&);
void steepness(const SteepnessTask&);
void sweep_cost(const SweepTask&);
void sweep_misfit(const SweepTask&);
void smooth(const SmoothTask&);
void weighted_median(const MedianTask&);
void mix(const MixTask&);

extern const Kernels kTable;

}  // namespace dd::DD_ISA
