// Python bindings of the kernels of a training step: like module.cpp, buffers in and buffers out.
#include "parts.h"

#include <nanobind/stl/pair.h>
#include <nanobind/stl/vector.h>

#if defined(__GLIBC__)
#include <malloc.h>
#endif

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "arrays.h"
#include "core/threads.h"
#include "kernels/types.h"

namespace {

using Flags = nb::ndarray<const bool, nb::c_contig, nb::device::cpu>;
const uint8_t* bytes(const Flags& flags) { return reinterpret_cast<const uint8_t*>(flags.data()); }

// Structural similarity -----------------------------------------------------------------------------------------------

constexpr int kBand = 34;  // rows

int64_t bands_of(const dd::SsimTask& task) { return (task.height + kBand - 1) / kBand; }

// Runs an SSIM kernel over bands of rows.
void run_bands(const dd::SsimTask& whole, void (*kernel)(const dd::SsimTask&), PartSums<2>* sums = nullptr) {
  const size_t scratch = size_t(dd::kSsimScratchRows) * dd::ssim_row(whole.width);
  const int workers = dd::thread_count();
  std::vector<float> work(scratch * workers);
  const auto run = [&](int64_t band, int worker) {
    dd::SsimTask task = whole;
    task.first_row = int(band) * kBand;
    task.last_row = std::min(task.height, task.first_row + kBand);
    task.scratch = work.data() + worker * scratch;
    task.sums = sums ? sums->of(band) : nullptr;
    kernel(task);
  };
  dd::parallel_for(bands_of(whole), run, workers);
}

// The partial derivatives of the map are three images one after the other, or none.
dd::SsimTask ssim_task(const In& image, const In& target, const float* partials, size_t partials_size) {
  if (image.ndim() != 3 || image.shape(2) != 3) throw nb::value_error("image: expected (h, w, 3)");
  expect_size("target", target.size(), image.size());
  dd::SsimTask task = {};
  task.image = image.data();
  task.target = target.data();
  task.height = int(image.shape(0));
  task.width = int(image.shape(1));
  if (partials) {
    expect_size("partials", partials_size, 3 * image.size());
    task.d_mean = const_cast<float*>(partials);
    task.d_square = task.d_mean + image.size();
    task.d_product = task.d_square + image.size();
  }
  return task;
}
dd::SsimTask ssim_task(const In& image, const In& target, const std::optional<Out>& partials) {
  return ssim_task(image, target, partials ? partials->data() : nullptr, partials ? partials->size() : 0);
}
dd::SsimTask ssim_task(const In& image, const In& target, const In& partials) {
  return ssim_task(image, target, partials.data(), partials.size());
}

void ssim_forward(In image, In target, Out map, std::optional<Out> partials) {
  dd::SsimTask task = ssim_task(image, target, partials);
  expect_size("map", map.size(), image.size());
  task.map = map.data();
  nb::gil_scoped_release release;
  run_bands(task, dd::kernels().ssim);
}

void ssim_backward(In image, In target, In partials, In d_map, Out d_image) {
  dd::SsimTask task = ssim_task(image, target, partials);
  expect_size("d_map", d_map.size(), image.size());
  expect_size("d_image", d_image.size(), image.size());
  task.d_map = d_map.data();
  task.d_image = d_image.data();
  nb::gil_scoped_release release;
  run_bands(task, dd::kernels().ssim_backward);
}

// Mean absolute difference and mean similarity where the mask is on; elsewhere the images count as equal.
std::pair<double, double> l1_ssim(In image, In target, Flags mask, std::optional<Out> partials) {
  dd::SsimTask task = ssim_task(image, target, partials);
  expect_size("mask", mask.size(), image.size() / 3);
  task.mask = bytes(mask);
  nb::gil_scoped_release release;
  PartSums<2> sums(bands_of(task));
  run_bands(task, dd::kernels().l1_ssim, &sums);
  const auto total = sums.total();
  return {total[0] / double(image.size()), total[1] / double(image.size())};
}

void l1_ssim_backward(In image, In target, Flags mask, In partials, double by_l1, double by_ssim, Out d_image) {
  dd::SsimTask task = ssim_task(image, target, partials);
  expect_size("mask", mask.size(), image.size() / 3);
  expect_size("d_image", d_image.size(), image.size());
  task.mask = bytes(mask);
  task.by_difference = float(by_l1 / double(image.size()));
  task.by_similarity = float(by_ssim / double(image.size()));
  task.d_image = d_image.data();
  nb::gil_scoped_release release;
  run_bands(task, dd::kernels().l1_ssim_backward);
}

// Pixels by themselves ------------------------------------------------------------------------------------------------

constexpr int64_t kPixels = 4096;  // of one part

int64_t pixel_parts(int64_t pixels) { return (pixels + kPixels - 1) / kPixels; }

dd::PictureTask picture_task(const In& colour, const In& alpha, const In& sky, const In& affine) {
  expect_size("colour", colour.size(), 3 * alpha.size());
  expect_size("sky", sky.size(), 3 * alpha.size());
  expect_size("affine", affine.size(), 12);
  dd::PictureTask task = {};
  task.colour = colour.data();
  task.alpha = alpha.data();
  task.sky = sky.data();
  task.affine = affine.data();
  return task;
}

void over_sky(In colour, In alpha, In sky, In affine, Out picture) {
  dd::PictureTask whole = picture_task(colour, alpha, sky, affine);
  expect_size("picture", picture.size(), colour.size());
  whole.picture = picture.data();
  nb::gil_scoped_release release;
  in_parts(int64_t(alpha.size()), kPixels, [&](int64_t first, int64_t last, int64_t) {
    dd::PictureTask task = whole;
    task.first = first;
    task.last = last;
    dd::kernels().over_sky(task);
  });
}

void over_sky_backward(In colour, In alpha, In sky, In affine, In d_picture, Out d_colour, Out d_alpha, Out d_affine) {
  dd::PictureTask whole = picture_task(colour, alpha, sky, affine);
  expect_size("d_picture", d_picture.size(), colour.size());
  expect_size("d_colour", d_colour.size(), colour.size());
  expect_size("d_alpha", d_alpha.size(), alpha.size());
  expect_size("d_affine", d_affine.size(), 12);
  whole.d_picture = d_picture.data();
  whole.d_colour = d_colour.data();
  whole.d_alpha = d_alpha.data();
  nb::gil_scoped_release release;
  PartSums<12> sums(pixel_parts(int64_t(alpha.size())));
  in_parts(int64_t(alpha.size()), kPixels, [&](int64_t first, int64_t last, int64_t part) {
    dd::PictureTask task = whole;
    task.first = first;
    task.last = last;
    task.d_affine = sums.of(part);
    dd::kernels().over_sky_backward(task);
  });
  const auto total = sums.total();
  std::copy(total.begin(), total.end(), d_affine.data());
}

// Returns by_disparity * disparity + by_coverage * coverage, both means, and writes its gradients if they are wanted.
double geometry_loss(In depth_sum, In alpha, In reference, In weight, Flags sky, double by_disparity, double by_coverage,
                     double whole_weight, std::optional<Out> d_depth_sum, std::optional<Out> d_alpha) {
  const size_t pixels = alpha.size();
  expect_size("depth_sum", depth_sum.size(), pixels);
  expect_size("reference", reference.size(), pixels);
  expect_size("weight", weight.size(), pixels);
  expect_size("sky", sky.size(), pixels);
  if (d_depth_sum) expect_size("d_depth_sum", d_depth_sum->size(), pixels);
  if (d_alpha) expect_size("d_alpha", d_alpha->size(), pixels);
  if (bool(d_depth_sum) != bool(d_alpha)) throw nb::value_error("expected both gradients or none");
  const double disparity_share = by_disparity / whole_weight, coverage_share = by_coverage / double(pixels);
  dd::GeometryLossTask whole = {};
  whole.depth_sum = depth_sum.data();
  whole.alpha = alpha.data();
  whole.reference = reference.data();
  whole.weight = weight.data();
  whole.sky = bytes(sky);
  whole.by_disparity = float(disparity_share);
  whole.by_coverage = float(coverage_share);
  whole.d_depth_sum = pointer(d_depth_sum);
  whole.d_alpha = pointer(d_alpha);
  nb::gil_scoped_release release;
  PartSums<2> sums(pixel_parts(int64_t(pixels)));
  in_parts(int64_t(pixels), kPixels, [&](int64_t first, int64_t last, int64_t part) {
    dd::GeometryLossTask task = whole;
    task.first = first;
    task.last = last;
    task.sums = sums.of(part);
    dd::kernels().geometry_loss(task);
  });
  const auto total = sums.total();
  return disparity_share * total[0] + coverage_share * total[1];
}

// Gaussians -----------------------------------------------------------------------------------------------------------

constexpr int64_t kGaussians = 2048;  // of one part

void activate(In means, std::optional<In> unit, std::optional<In> offsets, In quaternions, In log_scales, In logits,
              In sh, int64_t to, Out out_means, Out out_quaternions, Out scales, Out opacities, Out out_sh) {
  const size_t n = logits.size(), all = opacities.size(), sh_size = n ? sh.size() / n : 0;
  expect_size("means", means.size(), 3 * n);
  expect_size("quaternions", quaternions.size(), 4 * n);
  expect_size("log_scales", log_scales.size(), 3 * n);
  expect_size("sh", sh.size(), sh_size * n);
  if (unit || offsets) {
    expect_size("unit", unit ? unit->size() : 0, n);
    expect_size("offsets", offsets ? offsets->size() : 0, 3 * n);
  }
  if (to < 0 || size_t(to) + n > all) throw nb::value_error("to: the part does not fit behind the others");
  expect_size("out_means", out_means.size(), 3 * all);
  expect_size("out_quaternions", out_quaternions.size(), 4 * all);
  expect_size("scales", scales.size(), 3 * all);
  expect_size("out_sh", out_sh.size(), n ? sh_size * all : out_sh.size());
  dd::ActivationTask whole = {};
  whole.means = means.data();
  whole.unit = pointer(unit);
  whole.offsets = pointer(offsets);
  whole.quaternions = quaternions.data();
  whole.log_scales = log_scales.data();
  whole.logits = logits.data();
  whole.sh = sh.data();
  whole.to = to;
  whole.sh_size = int(sh_size);
  whole.out_means = out_means.data();
  whole.out_quaternions = out_quaternions.data();
  whole.scales = scales.data();
  whole.opacities = opacities.data();
  whole.out_sh = out_sh.data();
  nb::gil_scoped_release release;
  in_parts(int64_t(n), kGaussians, [&](int64_t first, int64_t last, int64_t) {
    dd::ActivationTask task = whole;
    task.first = first;
    task.last = last;
    dd::kernels().activate(task);
  });
}

void activate_backward(std::optional<In> unit, int64_t to, In scales, In opacities, In d_means, In d_scales,
                       In d_opacities, std::optional<Out> d_offsets, Out d_log_scales, Out d_logits) {
  const size_t n = d_logits.size(), all = opacities.size();
  expect_size("scales", scales.size(), 3 * all);
  expect_size("d_means", d_means.size(), 3 * all);
  expect_size("d_scales", d_scales.size(), 3 * all);
  expect_size("d_opacities", d_opacities.size(), all);
  expect_size("d_log_scales", d_log_scales.size(), 3 * n);
  if (unit || d_offsets) {
    expect_size("unit", unit ? unit->size() : 0, n);
    expect_size("d_offsets", d_offsets ? d_offsets->size() : 0, 3 * n);
  }
  if (to < 0 || size_t(to) + n > all) throw nb::value_error("to: the part does not fit behind the others");
  dd::ActivationTask whole = {};
  whole.unit = pointer(unit);
  whole.to = to;
  whole.scales = const_cast<float*>(scales.data());
  whole.opacities = const_cast<float*>(opacities.data());
  whole.d_means = d_means.data();
  whole.d_scales = d_scales.data();
  whole.d_opacities = d_opacities.data();
  whole.d_offsets = pointer(d_offsets);
  whole.d_log_scales = d_log_scales.data();
  whole.d_logits = d_logits.data();
  nb::gil_scoped_release release;
  in_parts(int64_t(n), kGaussians, [&](int64_t first, int64_t last, int64_t) {
    dd::ActivationTask task = whole;
    task.first = first;
    task.last = last;
    dd::kernels().activate_backward(task);
  });
}

// One Adam step of several tensors, each with a step size for every column of its rows and a number of the step, from 1.
void adam(std::vector<Out> values, std::vector<In> gradients, std::vector<Out> means, std::vector<Out> squares,
          std::vector<std::vector<float>> rates, std::vector<int64_t> steps, double beta1, double beta2, double epsilon) {
  constexpr int64_t kRows = 1024;  // of one part: whole rows of lanes for any number of columns
  for (size_t count : {gradients.size(), means.size(), squares.size(), rates.size(), steps.size()})
    if (count != values.size()) throw nb::value_error("expected as many gradients, moments, rates and steps as values");
  std::vector<dd::AdamTask> tasks;
  for (size_t t = 0; t < values.size(); t++) {
    const size_t size = values[t].size(), columns = rates[t].size();
    expect_size("gradient", gradients[t].size(), size);
    expect_size("mean", means[t].size(), size);
    expect_size("square", squares[t].size(), size);
    if (columns < 1 || columns > dd::kMostColumns || size % columns)
      throw nb::value_error("rates: expected one for each of at most 64 columns");
    if (steps[t] < 1) throw nb::value_error("steps: expected at least 1");
    dd::AdamTask task = {};
    task.value = values[t].data();
    task.gradient = gradients[t].data();
    task.mean = means[t].data();
    task.square = squares[t].data();
    task.rates = rates[t].data();
    task.columns = int(columns);
    task.new_mean = float(1 - beta1);
    task.keep_square = float(beta2);
    task.new_square = float(1 - beta2);
    task.epsilon = float(epsilon);
    task.scale_mean = float(1 / (1 - std::pow(beta1, double(steps[t]))));
    task.scale_root = float(1 / std::sqrt(1 - std::pow(beta2, double(steps[t]))));
    const int64_t part = kRows * int64_t(columns);
    for (task.first = 0; task.first < int64_t(size); task.first = task.last) {
      task.last = std::min(int64_t(size), task.first + part);
      tasks.push_back(task);
    }
  }
  nb::gil_scoped_release release;
  dd::parallel_for(int64_t(tasks.size()), [&](int64_t i, int) { dd::kernels().adam(tasks[i]); });
}

// A step frees and takes the same hundred megabytes again and again. By default glibc hands them back to the kernel in
// between, which then has to clear every page anew: a tenth of a step.
void keep_freed_memory() {
#if defined(__GLIBC__)
  mallopt(M_TRIM_THRESHOLD, 256 << 20);
  mallopt(M_MMAP_THRESHOLD, 32 << 20);
#endif
}

}  // namespace

void bind_fit(nb::module_& m) {
  m.def("ssim_forward", &ssim_forward, array("image"), array("target"), array("map"), maybe("partials"));
  m.def("ssim_backward", &ssim_backward, array("image"), array("target"), array("partials"), array("d_map"),
        array("d_image"));
  m.def("l1_ssim", &l1_ssim, array("image"), array("target"), array("mask"), maybe("partials"));
  m.def("l1_ssim_backward", &l1_ssim_backward, array("image"), array("target"), array("mask"), array("partials"),
        "by_l1"_a, "by_ssim"_a, array("d_image"));
  m.def("over_sky", &over_sky, array("colour"), array("alpha"), array("sky"), array("affine"), array("picture"));
  m.def("over_sky_backward", &over_sky_backward, array("colour"), array("alpha"), array("sky"), array("affine"),
        array("d_picture"), array("d_colour"), array("d_alpha"), array("d_affine"));
  m.def("geometry_loss", &geometry_loss, array("depth_sum"), array("alpha"), array("reference"), array("weight"),
        array("sky"), "by_disparity"_a, "by_coverage"_a, "whole_weight"_a, maybe("d_depth_sum"), maybe("d_alpha"));
  m.def("activate", &activate, array("means"), maybe("unit"), maybe("offsets"), array("quaternions"), array("log_scales"),
        array("logits"), array("sh"), "to"_a, array("out_means"), array("out_quaternions"), array("scales"),
        array("opacities"), array("out_sh"));
  m.def("activate_backward", &activate_backward, maybe("unit"), "to"_a, array("scales"), array("opacities"),
        array("d_means"), array("d_scales"), array("d_opacities"), maybe("d_offsets"), array("d_log_scales"),
        array("d_logits"));
  m.def("adam", &adam, array("values"), array("gradients"), array("means"), array("squares"), "rates"_a, "steps"_a,
        "beta1"_a, "beta2"_a, "epsilon"_a);
  m.def("keep_freed_memory", &keep_freed_memory);
}
