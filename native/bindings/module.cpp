// Python bindings: raw float32 buffers in, results written into buffers that the caller owns.
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/unique_ptr.h>

#include <memory>
#include <optional>
#include <string>

#include "core/check.h"
#include "core/rasterize.h"
#include "core/threads.h"
#include "parts.h"

namespace nb = nanobind;
using namespace nb::literals;

namespace {

template <class... Shape>
using In = nb::ndarray<const float, nb::c_contig, nb::device::cpu, Shape...>;
template <class... Shape>
using Out = nb::ndarray<float, nb::c_contig, nb::device::cpu, Shape...>;
using InAny = In<>;
using OutAny = Out<>;
using Visible = nb::ndarray<bool, nb::ndim<1>, nb::c_contig, nb::device::cpu>;

struct PyFrame {
  dd::FrameHandle frame;
};

// The Gaussians of one call; the arrays are held so that their memory stays.
struct Gaussians {
  InAny means, quaternions, scales, opacities, sh;
  std::optional<InAny> channels, offsets;
  int sh_degree;

  dd::Inputs inputs() const {
    dd::Inputs in;
    in.means = means.data();
    in.quaternions = quaternions.data();
    in.scales = scales.data();
    in.opacities = opacities.data();
    in.sh = sh.data();
    in.channels = channels ? channels->data() : nullptr;
    in.offsets = offsets ? offsets->data() : nullptr;
    in.n = int64_t(means.shape(0));
    in.sh_stored = int(sh.shape(1));
    in.sh_degree = sh_degree;
    in.n_channels = channels ? int(channels->shape(1)) : 0;
    return in;
  }
};

void expect_size(const char* name, size_t size, size_t expected) {
  if (size != expected)
    throw nb::value_error((std::string(name) + ": expected " + std::to_string(expected) + " numbers, got " +
                           std::to_string(size)).c_str());
}

Gaussians make_gaussians(InAny means, InAny quaternions, InAny scales, InAny opacities, InAny sh,
                         std::optional<InAny> channels, std::optional<InAny> offsets, int sh_degree) {
  if (means.ndim() != 2 || sh.ndim() != 3 || (channels && channels->ndim() != 2))
    throw nb::value_error("expected means (n, 3), sh (n, k, 3) and channels (n, c)");
  const size_t n = means.shape(0);
  expect_size("means", means.size(), 3 * n);
  expect_size("quaternions", quaternions.size(), 4 * n);
  expect_size("scales", scales.size(), 3 * n);
  expect_size("opacities", opacities.size(), n);
  expect_size("sh", sh.size(), 3 * n * sh.shape(1));
  if (channels) expect_size("channels", channels->size(), n * channels->shape(1));
  if (offsets) expect_size("screen_offsets_px", offsets->size(), 2 * n);
  if (n >= dd::kHidden) throw nb::value_error("means: too many Gaussians");
  if (sh_degree < 0 || sh_degree > 3 || size_t((sh_degree + 1) * (sh_degree + 1)) > sh.shape(1))
    throw nb::value_error("sh_degree: expected 0 to 3 and no more than stored");
  return {means, quaternions, scales, opacities, sh, channels, offsets, sh_degree};
}

std::unique_ptr<PyFrame> forward(const Gaussians& gaussians, In<nb::shape<4, 4>> camera_from_world, float fx, float fy,
                                 float cx, float cy, int width, int height, bool antialiased, OutAny colour, OutAny alpha, OutAny depth,
                                 OutAny channels, Visible visible, bool keep) {
  const dd::Inputs in = gaussians.inputs();
  if (width < 1 || height < 1) throw nb::value_error("width_px, height_px: expected at least 1");
  const size_t pixels = size_t(width) * size_t(height);
  expect_size("colour", colour.size(), 3 * pixels);
  expect_size("alpha", alpha.size(), pixels);
  expect_size("depth", depth.size(), pixels);
  expect_size("channels", channels.size(), pixels * in.n_channels);
  expect_size("visible", visible.size(), in.n);
  auto out = std::make_unique<PyFrame>();
  out->frame = dd::take_frame();
  out->frame->view = dd::make_view(camera_from_world.data(), fx, fy, cx, cy, width, height, antialiased);
  const dd::Images images = {colour.data(), alpha.data(), depth.data(), channels.data()};
  auto* seen = reinterpret_cast<uint8_t*>(visible.data());
  {
    nb::gil_scoped_release release;
    dd::render_forward(in, *out->frame, keep, images, seen);
  }
  return keep ? std::move(out) : nullptr;
}

const float* pointer(const std::optional<InAny>& array) { return array ? array->data() : nullptr; }
float* pointer(std::optional<OutAny>& array) { return array ? array->data() : nullptr; }

void backward(const Gaussians& gaussians, PyFrame& frame, std::optional<InAny> colour, std::optional<InAny> alpha,
              std::optional<InAny> depth, std::optional<InAny> channels, std::optional<OutAny> d_means,
              std::optional<OutAny> d_quaternions, std::optional<OutAny> d_scales, std::optional<OutAny> d_opacities,
              std::optional<OutAny> d_sh, std::optional<OutAny> d_channels, std::optional<OutAny> d_screen,
              std::optional<OutAny> d_screen_absolute, Out<nb::shape<4, 4>> d_pose) {
  const dd::Inputs in = gaussians.inputs();
  const size_t pixels = size_t(frame.frame->view.width) * size_t(frame.frame->view.height), n = size_t(in.n);
  if (in.n != frame.frame->n) throw nb::value_error("the frame was made from another number of Gaussians");
  if (colour) expect_size("colour", colour->size(), 3 * pixels);
  if (alpha) expect_size("alpha", alpha->size(), pixels);
  if (depth) expect_size("depth", depth->size(), pixels);
  if (channels) expect_size("channels", channels->size(), pixels * in.n_channels);
  if (d_means) expect_size("d_means", d_means->size(), 3 * n);
  if (d_quaternions) expect_size("d_quaternions", d_quaternions->size(), 4 * n);
  if (d_scales) expect_size("d_scales", d_scales->size(), 3 * n);
  if (d_opacities) expect_size("d_opacities", d_opacities->size(), n);
  if (d_sh) expect_size("d_sh", d_sh->size(), 3 * n * in.sh_stored);
  if (d_channels) expect_size("d_channels", d_channels->size(), n * in.n_channels);
  if (d_screen) expect_size("d_screen", d_screen->size(), 2 * n);
  if (d_screen_absolute) expect_size("d_screen_absolute", d_screen_absolute->size(), 2 * n);
  const dd::ImageGradients upstream = {pointer(colour), pointer(alpha), pointer(depth), pointer(channels)};
  const dd::Gradients out = {pointer(d_means), pointer(d_quaternions), pointer(d_scales), pointer(d_opacities),
                             pointer(d_sh),    pointer(d_channels),    pointer(d_screen),
                             pointer(d_screen_absolute)};
  float* pose = d_pose.data();
  nb::gil_scoped_release release;
  dd::render_backward(in, *frame.frame, upstream, out, pose);
}

void inspect(const Gaussians& gaussians, PyFrame& frame, OutAny median_depth, OutAny weight_sum, OutAny weight_most) {
  const dd::Inputs in = gaussians.inputs();
  if (in.n != frame.frame->n) throw nb::value_error("the frame was made from another number of Gaussians");
  expect_size("median_depth", median_depth.size(), size_t(frame.frame->view.width) * size_t(frame.frame->view.height));
  expect_size("weight_sum", weight_sum.size(), in.n);
  expect_size("weight_most", weight_most.size(), in.n);
  float *median = median_depth.data(), *sum = weight_sum.data(), *most = weight_most.data();
  nb::gil_scoped_release release;
  dd::render_inspect(in, *frame.frame, median, sum, most);
}

bool all_usable(const Gaussians& gaussians) {
  const dd::Inputs in = gaussians.inputs();
  nb::gil_scoped_release release;
  return dd::all_usable(in);
}

nb::dict stage_seconds() {
  const dd::StageSeconds seconds = dd::stage_seconds();
  nb::dict out;
  out["project"] = seconds.project;
  out["sort"] = seconds.sort;
  out["tiles"] = seconds.tiles;
  out["composite"] = seconds.composite;
  out["composite_backward"] = seconds.composite_backward;
  out["project_backward"] = seconds.project_backward;
  return out;
}

void set_threads(int count) {
  if (count < 1 || count > dd::kMostThreads) throw nb::value_error("threads: expected 1 to 1024");
  nb::gil_scoped_release release;
  dd::set_thread_count(count);
}

}  // namespace

NB_MODULE(_native, m) {
  nb::set_leak_warnings(false);  // a graph that a global still holds when Python exits is no leak
  nb::class_<PyFrame>(m, "Frame");
  nb::class_<Gaussians>(m, "Gaussians");
  m.def("gaussians", &make_gaussians, "means"_a, "quaternions"_a, "scales"_a, "opacities"_a, "sh"_a,
        "channels"_a.none(), "offsets"_a.none(), "sh_degree"_a);
  m.def("forward", &forward, "gaussians"_a, "camera_from_world"_a, "fx"_a, "fy"_a, "cx"_a, "cy"_a, "width"_a,
        "height"_a, "antialiased"_a, "colour"_a, "alpha"_a, "depth"_a, "channels"_a, "visible"_a, "keep"_a);
  m.def("backward", &backward, "gaussians"_a, "frame"_a, "colour"_a.none(), "alpha"_a.none(), "depth"_a.none(),
        "channels"_a.none(), "d_means"_a.none(), "d_quaternions"_a.none(), "d_scales"_a.none(),
        "d_opacities"_a.none(), "d_sh"_a.none(), "d_channels"_a.none(), "d_screen"_a.none(), "d_screen_absolute"_a.none(),
        "d_pose"_a);
  m.def("inspect", &inspect, "gaussians"_a, "frame"_a, "median_depth"_a, "weight_sum"_a, "weight_most"_a);
  m.def("all_usable", &all_usable, "gaussians"_a);
  m.def("stage_seconds", &stage_seconds);
  m.def("set_threads", &set_threads, "count"_a);
  m.def("threads", &dd::thread_count);
  m.def("isa", [] { return std::string(dd::kernels().isa); });
  bind_fit(m);
  bind_geometry(m);
  bind_motion(m);
  bind_restore(m);
}
