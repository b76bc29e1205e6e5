// Python bindings of the kernels that find depth: like module.cpp, buffers in and buffers out. Each call is one thread's:
// who has many frames takes a thread for each.
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <limits>
#include <vector>

#include "arrays.h"
#include "core/buffer.h"
#include "core/cut.h"
#include "kernels/types.h"
#include "parts.h"

namespace {

using Flags = nb::ndarray<const bool, nb::c_contig, nb::device::cpu>;
using Marks = nb::ndarray<bool, nb::c_contig, nb::device::cpu>;
using Whole = nb::ndarray<const int32_t, nb::c_contig, nb::device::cpu>;
using Doubles = nb::ndarray<const double, nb::c_contig, nb::device::cpu>;

// Pictures laid over a reference, see dd::SweepSource; the arrays are held by who calls.
struct Sources {
  std::vector<std::vector<float>> usable;
  std::vector<dd::SweepSource> each;

  Sources(const std::vector<In>& greys, const std::vector<Flags>& flags, const Doubles& homographies, const In& grey) {
    if (grey.ndim() != 2 || grey.shape(0) < 2 || grey.shape(1) < 2)
      throw nb::value_error("grey: expected (h, w), 2 pixels at least");
    if (homographies.ndim() != 4 || homographies.shape(0) != greys.size() || flags.size() != greys.size())
      throw nb::value_error("expected a picture, its usable pixels and homographies (labels, 3, 3) for each source");
    expect_size("homographies", homographies.size(), homographies.shape(0) * homographies.shape(1) * 9);
    usable.resize(greys.size());
    for (size_t s = 0; s < greys.size(); s++) {
      expect_size("a source", greys[s].size(), grey.size());
      expect_size("usable pixels", flags[s].size(), grey.size());
      const bool *first = flags[s].data(), *last = first + grey.size();
      if (!std::all_of(first, last, [](bool each) { return each; })) usable[s].assign(first, last);
      each.push_back({greys[s].data(), usable[s].empty() ? nullptr : usable[s].data(),
                      homographies.data() + s * homographies.shape(1) * 9});
    }
  }
  dd::SweepTask task(const In& grey, const Doubles& homographies, float least_z, float* out) const {
    dd::SweepTask task = {};
    task.height = int(grey.shape(0));
    task.width = int(grey.shape(1));
    task.labels = int(homographies.shape(1));
    task.n_sources = int(each.size());
    task.sources = each.data();
    task.least_z = least_z;
    task.grey = grey.data();
    task.out = out;
    return task;
  }
};

void sweep_cost(In grey, In mean, In variance, std::vector<In> greys, std::vector<Flags> usable, Doubles homographies,
                int side, float centre, float noise, float least_z, Out cost) {
  const Sources sources(greys, usable, homographies, grey);
  dd::SweepTask task = sources.task(grey, homographies, least_z, cost.data());
  expect_size("mean", mean.size(), grey.size());
  expect_size("variance", variance.size(), grey.size());
  expect_size("cost", cost.size(), grey.size() * task.labels);
  if (side < 1 || side % 2 == 0 || side > dd::kMostSide) throw nb::value_error("side: expected an odd number up to 127");
  task.mean = mean.data();
  task.variance = variance.data();
  task.side = side;
  task.centre = centre;
  task.noise = noise;
  nb::gil_scoped_release release;
  dd::Buffer<float> scratch;
  task.scratch = scratch.resize(dd::sweep_scratch(task.width, side, task.n_sources));
  dd::kernels().sweep_cost(task);
}

void sweep_misfit(In grey, std::vector<In> greys, std::vector<Flags> usable, Doubles homographies, float least_z,
                  float most, Out misfit) {
  const Sources sources(greys, usable, homographies, grey);
  dd::SweepTask task = sources.task(grey, homographies, least_z, misfit.data());
  expect_size("misfit", misfit.size(), grey.size() * task.labels);
  task.most = most;
  nb::gil_scoped_release release;
  dd::Buffer<float> scratch;
  task.scratch = scratch.resize(dd::sweep_scratch(task.width, 1, 0));
  dd::kernels().sweep_misfit(task);
}

void smooth(In cost, In jump_down, In jump_right, float step, Out total, Out label) {
  if (cost.ndim() != 3) throw nb::value_error("cost: expected (h, labels, w)");
  dd::SmoothTask task = {};
  task.height = int(cost.shape(0));
  task.labels = int(cost.shape(1));
  task.width = int(cost.shape(2));
  expect_size("jump_down", jump_down.size(), size_t(task.height - 1) * task.width);
  expect_size("jump_right", jump_right.size(), size_t(task.height) * (task.width - 1));
  expect_size("total", total.size(), cost.size());
  expect_size("label", label.size(), size_t(task.height) * task.width);
  task.cost = cost.data();
  task.jump_down = jump_down.data();
  task.jump_right = jump_right.data();
  task.step = step;
  task.total = total.data();
  task.label = label.data();
  nb::gil_scoped_release release;
  dd::Buffer<float> scratch;
  task.scratch = scratch.resize(dd::smooth_scratch(task.width, task.labels));
  dd::kernels().smooth(task);
}

void weighted_median(In values, In weights, Out median) {
  if (values.ndim() < 1 || values.shape(0) < 1) throw nb::value_error("values: expected (n, ...), n at least 1");
  dd::MedianTask task = {};
  task.count = int(values.shape(0));
  task.columns = int64_t(values.size() / values.shape(0));
  expect_size("weights", weights.size(), values.size());
  expect_size("median", median.size(), task.columns);
  task.values = values.data();
  task.weights = weights.data();
  task.out = median.data();
  nb::gil_scoped_release release;
  dd::Buffer<float> scratch;
  task.scratch = scratch.resize(2 * 16 * size_t(task.count));
  dd::kernels().weighted_median(task);
}

void minimum_cut(Whole gain, Whole right, Whole below, Marks labelled) {
  if (gain.ndim() != 2) throw nb::value_error("gain: expected (h, w)");
  const int height = int(gain.shape(0)), width = int(gain.shape(1));
  expect_size("right", right.size(), size_t(height) * (width - 1));
  expect_size("below", below.size(), size_t(height - 1) * width);
  expect_size("labelled", labelled.size(), gain.size());
  // So that no sum of what flows over an edge or into a pixel overflows.
  constexpr int32_t kMost = std::numeric_limits<int32_t>::max() / 2;
  const auto weighs = [](const Whole& edges) {
    return std::all_of(edges.data(), edges.data() + edges.size(), [](int32_t x) { return x >= 0 && x <= kMost; });
  };
  const bool earns = std::all_of(gain.data(), gain.data() + gain.size(), [](int32_t x) { return x >= -kMost && x <= kMost; });
  if (!earns || !weighs(right) || !weighs(below))
    throw nb::value_error("expected gains below 2^30 and weights of 0 or more below 2^30");
  auto* out = reinterpret_cast<uint8_t*>(labelled.data());
  nb::gil_scoped_release release;
  dd::minimum_cut(height, width, gain.data(), right.data(), below.data(), out);
}

}  // namespace

void bind_geometry(nb::module_& m) {
  m.def("sweep_cost", &sweep_cost, array("grey"), array("mean"), array("variance"), "greys"_a, "usable"_a,
        array("homographies"), "side"_a, "centre"_a, "noise"_a, "least_z"_a, array("cost"));
  m.def("sweep_misfit", &sweep_misfit, array("grey"), "greys"_a, "usable"_a, array("homographies"), "least_z"_a, "most"_a,
        array("misfit"));
  m.def("smooth", &smooth, array("cost"), array("jump_down"), array("jump_right"), "step"_a, array("total"),
        array("label"));
  m.def("weighted_median", &weighted_median, array("values"), array("weights"), array("median"));
  m.def("minimum_cut", &minimum_cut, array("gain"), array("right"), array("below"), array("labelled"));
}
