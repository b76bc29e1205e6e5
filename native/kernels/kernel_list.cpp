// The table of the kernels of one instruction set.
#include "kernel_list.h"

#define DD_STRING_(x) #x
#define DD_STRING(x) DD_STRING_(x)

namespace dd::DD_ISA {

const Kernels kTable = {DD_STRING(DD_ISA), project, project_backward, cover, composite, composite_backward, inspect, ssim, ssim_backward,
                        l1_ssim, l1_ssim_backward, over_sky, over_sky_backward, geometry_loss, adam, activate,
                        activate_backward, network, network_backward, planes, planes_backward,
                        steepness, sweep_cost, sweep_misfit, smooth,
                        weighted_median, mix};

}  // namespace dd::DD_ISA
