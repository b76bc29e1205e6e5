// The CPU rasteriser of a user's OpenSplat checkout for Python. Compiled beside it by opensplat.py; nothing of it is kept here.
#include <torch/extension.h>

#include <memory>

#include "rasterizer/gsplat-cpu/bindings.h"

namespace {

// For each pixel the Gaussians that reached it, which only the backward pass reads.
struct PixelLists {
  std::unique_ptr<std::vector<int32_t>[]> of_pixel;
};

auto project(torch::Tensor means, torch::Tensor scales, torch::Tensor quaternions, torch::Tensor view,
             torch::Tensor projection, float fx, float fy, float cx, float cy, unsigned height, unsigned width) {
  return project_gaussians_forward_tensor_cpu(int(means.size(0)), means, scales, 1.0f, quaternions, view, projection, fx,
                                              fy, cx, cy, height, width, 0.01f);
}

auto rasterize(int width, int height, torch::Tensor centres, torch::Tensor conics, torch::Tensor colours,
               torch::Tensor opacities, torch::Tensor background, torch::Tensor covariances, torch::Tensor depths) {
  auto [image, transmittance, lists] = rasterize_forward_tensor_cpu(width, height, centres, conics, colours, opacities,
                                                                    background, covariances, depths);
  auto kept = std::make_shared<PixelLists>();
  kept->of_pixel.reset(lists);
  return std::make_tuple(image, transmittance, kept);
}

auto rasterize_backward(int width, int height, torch::Tensor centres, torch::Tensor conics, torch::Tensor colours,
                        torch::Tensor opacities, torch::Tensor background, torch::Tensor covariances,
                        torch::Tensor depths, torch::Tensor transmittance, std::shared_ptr<PixelLists> lists,
                        torch::Tensor by_image, torch::Tensor by_alpha) {
  return rasterize_backward_tensor_cpu(height, width, centres, conics, colours, opacities, background, covariances,
                                       depths, transmittance, lists->of_pixel.get(), by_image, by_alpha);
}

}  // namespace

PYBIND11_MODULE(TORCH_EXTENSION_NAME, m) {
  pybind11::class_<PixelLists, std::shared_ptr<PixelLists>>(m, "PixelLists");
  m.def("project", &project);
  m.def("rasterize", &rasterize);
  m.def("rasterize_backward", &rasterize_backward);
}
