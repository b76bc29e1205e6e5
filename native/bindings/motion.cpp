// Python bindings of what moves Gaussians: networks, feature planes and tracks.
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "arrays.h"
#include "core/hexplane.h"
#include "core/network_run.h"
#include "core/pose.h"
#include "kernels/types.h"
#include "parts.h"

namespace {

// Networks ------------------------------------------------------------------------------------------------------------

// Weight and bias of each hidden layer, then of each head.
struct Network {
  std::vector<In> tensors;
  dd::NetworkShape shape;
  std::vector<dd::Dense> layers;
};

Network make_network(std::vector<In> tensors, dd::NetworkShape shape) {
  Network network = {std::move(tensors), shape, {}};
  const auto& t = network.tensors;
  const int depth = shape.depth, skip = shape.skip;
  const bool layers = depth >= 1 && size_t(depth) < t.size() / 2 && t[0].ndim() > 0;
  if (!layers || t.size() % 2 || skip >= depth || skip == 0)
    throw nb::value_error("expected hidden layers, then heads, weight and bias each");
  network.shape.width = int(t[0].shape(0));
  network.shape.last = int(t[2 * depth - 1].size());
  for (size_t d = 0; d < t.size() / 2; d++) {
    const In &weight = t[2 * d], &bias = t[2 * d + 1];
    const bool hidden = d < size_t(depth);
    const int before = d == 0 ? 0 : hidden ? network.shape.width : network.shape.last;
    const int inputs = before + (d == 0 || (hidden && int(d) == skip) ? shape.encoded() : 0);
    const int outputs = int(d) < depth - 1 ? network.shape.width : int(bias.size());
    expect_size("weight", weight.size(), size_t(inputs) * outputs);
    expect_size("bias", bias.size(), outputs);
    if (!hidden) network.shape.outputs += outputs;
    network.layers.push_back({weight.data(), bias.data(), outputs, inputs});
  }
  return network;
}

std::vector<dd::DenseGradient> network_gradients(const Network& network, std::vector<Out>& gradients) {
  if (gradients.size() != network.tensors.size())
    throw nb::value_error("gradients: expected one for each weight and bias");
  std::vector<dd::DenseGradient> out;
  for (size_t d = 0; d < network.layers.size(); d++) {
    expect_size("gradient", gradients[2 * d].size(), network.tensors[2 * d].size());
    expect_size("gradient", gradients[2 * d + 1].size(), network.tensors[2 * d + 1].size());
    out.push_back({gradients[2 * d].data(), gradients[2 * d + 1].data()});
  }
  return out;
}

// A network that reads points in their encoding, with that of a time.
struct EncodedNetwork {
  Network network;
  In means, centre, time_code;
  dd::NetworkTask task;
  int64_t n;
};

EncodedNetwork encoded_network(std::vector<In> tensors, int depth, int skip, In means, In centre, float radius,
                               int position_octaves, In time_code) {
  if (position_octaves < 0 || position_octaves > dd::kMostOctaves)
    throw nb::value_error("position_octaves: expected 0 to 32");
  if (means.size() % 3) throw nb::value_error("means: expected (n, 3)");
  expect_size("centre", centre.size(), 3);
  dd::NetworkShape shape = {};
  shape.depth = depth;
  shape.skip = skip;
  shape.position_octaves = position_octaves;
  shape.time_code = int(time_code.size());
  dd::NetworkTask task = {};
  task.means = means.data();
  task.centre = centre.data();
  task.time_code = time_code.data();
  task.radius = radius;
  const int64_t n = int64_t(means.size() / 3);
  return {make_network(std::move(tensors), shape), means, centre, time_code, task, n};
}

void encoded_network_forward(const EncodedNetwork& e, Out out) {
  expect_size("out", out.size(), e.n * e.network.shape.outputs);
  dd::NetworkTask task = e.task;
  task.out = out.data();
  nb::gil_scoped_release release;
  dd::network_forward(e.network.shape, e.network.layers, task, e.n);
}

void encoded_network_backward(const EncodedNetwork& e, In d_out, std::vector<Out> gradients) {
  expect_size("d_out", d_out.size(), e.n * e.network.shape.outputs);
  const auto out = network_gradients(e.network, gradients);
  dd::NetworkTask task = e.task;
  task.d_out = d_out.data();
  nb::gil_scoped_release release;
  dd::network_backward(e.network.shape, e.network.layers, task, e.n, out);
}

// A network that reads the rows of a matrix.
Network dense_network(std::vector<In> tensors, int depth) {
  if (tensors.empty() || tensors[0].ndim() != 2 || tensors[0].shape(1) < 1)
    throw nb::value_error("expected hidden layers, then heads, weight and bias each");
  dd::NetworkShape shape = {};
  shape.depth = depth;
  shape.skip = -1;
  shape.given = int(tensors[0].shape(1));
  return make_network(std::move(tensors), shape);
}

int64_t rows_of(const Network& network, const In& inputs) {
  const int64_t n = int64_t(inputs.size()) / network.shape.given;
  expect_size("inputs", inputs.size(), n * network.shape.given);
  return n;
}

void dense_network_forward(const Network& network, In inputs, Out out) {
  const int64_t n = rows_of(network, inputs);
  expect_size("out", out.size(), n * network.shape.outputs);
  dd::NetworkTask task = {};
  task.given = inputs.data();
  task.out = out.data();
  nb::gil_scoped_release release;
  dd::network_forward(network.shape, network.layers, task, n);
}

void dense_network_backward(const Network& network, In inputs, In d_out, Out d_inputs, std::vector<Out> gradients) {
  const int64_t n = rows_of(network, inputs);
  expect_size("d_out", d_out.size(), n * network.shape.outputs);
  expect_size("d_inputs", d_inputs.size(), inputs.size());
  const auto out = network_gradients(network, gradients);
  dd::NetworkTask task = {};
  task.given = inputs.data();
  task.d_out = d_out.data();
  task.d_given = d_inputs.data();
  nb::gil_scoped_release release;
  dd::network_backward(network.shape, network.layers, task, n, out);
}

// Planes of features --------------------------------------------------------------------------------------------------

// Planes of each level, with the points that read them.
struct Planes {
  dd::Hexplane levels;
  In means, low, high;
  dd::PlanesTask task;
  int64_t n;
};

Planes make_planes(std::vector<In> space, std::vector<In> lines, In means, In low, In high) {
  if (space.empty() || space.size() != lines.size()) throw nb::value_error("expected planes and lines of each level");
  std::vector<dd::PlaneLevel> levels;
  size_t channels = 0;
  for (size_t l = 0; l < space.size(); l++) {
    if (space[l].ndim() != 4 || space[l].shape(3) < 2) throw nb::value_error("space: expected (3, c, r, r), r at least 2");
    const size_t nodes = space[l].shape(3);
    channels = space[0].shape(1);
    expect_size("space", space[l].size(), 3 * channels * nodes * nodes);
    expect_size("lines", lines[l].size(), 3 * channels * nodes);
    levels.push_back({space[l].data(), lines[l].data(), int(nodes)});
  }
  if (means.size() % 3) throw nb::value_error("means: expected (n, 3)");
  expect_size("low", low.size(), 3);
  expect_size("high", high.size(), 3);
  dd::PlanesTask task = {};
  task.means = means.data();
  task.low = low.data();
  task.high = high.data();
  return {dd::Hexplane(levels, int(channels)), means, low, high, task, int64_t(means.size() / 3)};
}

size_t features_of(const Planes& p) { return size_t(p.n) * p.levels.levels().size() * p.levels.channels(); }

void planes_forward(const Planes& p, Out features) {
  expect_size("features", features.size(), features_of(p));
  nb::gil_scoped_release release;
  p.levels.forward(p.task, p.n, features.data());
}

void planes_backward(const Planes& p, In d_features, std::vector<Out> d_space, std::vector<Out> d_lines) {
  const auto& levels = p.levels.levels();
  expect_size("d_features", d_features.size(), features_of(p));
  if (d_space.size() != levels.size() || d_lines.size() != levels.size())
    throw nb::value_error("expected gradients of each level");
  std::vector<dd::PlaneLevelGradient> out;
  for (size_t l = 0; l < levels.size(); l++) {
    const size_t line = size_t(3) * p.levels.channels() * levels[l].nodes;
    expect_size("d_space", d_space[l].size(), line * levels[l].nodes);
    expect_size("d_lines", d_lines[l].size(), line);
    out.push_back({d_space[l].data(), d_lines[l].data()});
  }
  nb::gil_scoped_release release;
  p.levels.backward(p.task, p.n, d_features.data(), out);
}

// Weight times the mean squared difference of neighbours of square images, along one axis and along the other.
double steepness(In images, double weight, std::optional<Out> d_images) {
  if (images.ndim() < 2 || images.shape(images.ndim() - 1) < 2 ||
      images.shape(images.ndim() - 1) != images.shape(images.ndim() - 2))
    throw nb::value_error("images: expected (..., r, r), r at least 2");
  if (d_images) expect_size("d_images", d_images->size(), images.size());
  const int nodes = int(images.shape(images.ndim() - 1));
  const int64_t pixels = int64_t(nodes) * nodes, count = int64_t(images.size()) / pixels;
  const double share = weight / double(count * nodes * (nodes - 1));
  float* gradient = pointer(d_images);
  nb::gil_scoped_release release;
  PartSums<1> sums(count);
  in_parts(count, 1, [&](int64_t image, int64_t, int64_t part) {
    dd::Floats scratch(3 * dd::steepness_row(nodes), 0.0f);
    dd::SteepnessTask task = {};
    task.image = images.data() + image * pixels;
    task.nodes = nodes;
    task.by_sum = float(share);
    task.d_image = gradient ? gradient + image * pixels : nullptr;
    task.sum = sums.of(part);
    task.scratch = scratch.data();
    dd::kernels().steepness(task);
  });
  return share * sums.total()[0];
}

// Tracks --------------------------------------------------------------------------------------------------------------

using Index = nb::ndarray<const int64_t, nb::c_contig, nb::device::cpu>;

// Canonical Gaussians, what the network adds, and the tracks of a time.
struct Pose {
  In means, quaternions, log_scales, logits, residual;
  std::optional<In> lifespan;
  std::optional<Index> actor;
  In translation, yaw, pivot;
  dd::PoseTask task;
};

Pose make_pose(In means, In quaternions, In log_scales, In logits, In residual, std::optional<In> lifespan,
               std::optional<Index> actor, In translation, In yaw, In pivot, In up, float time_s) {
  const size_t n = logits.size();
  expect_size("means", means.size(), 3 * n);
  expect_size("quaternions", quaternions.size(), 4 * n);
  expect_size("log_scales", log_scales.size(), 3 * n);
  expect_size("residual", residual.size(), 10 * n);
  if (lifespan) expect_size("lifespan", lifespan->size(), 2 * n);
  if (actor) expect_size("actor", actor->size(), n);
  expect_size("translation", translation.size(), 3 * yaw.size());
  expect_size("pivot", pivot.size(), 3 * yaw.size());
  expect_size("up", up.size(), 3);
  dd::PoseTask task = {};
  task.n = int64_t(n);
  task.means = means.data();
  task.quaternions = quaternions.data();
  task.log_scales = log_scales.data();
  task.logits = logits.data();
  task.residual = residual.data();
  task.lifespan = pointer(lifespan);
  task.actor = actor ? actor->data() : nullptr;
  task.translation = translation.data();
  task.yaw = yaw.data();
  task.pivot = pivot.data();
  task.actors = int64_t(yaw.size());
  std::copy_n(up.data(), 3, task.up);
  task.time_s = time_s;
  for (size_t i = 0; actor && i < n; i++)
    if (task.actor[i] >= task.actors) throw nb::value_error("actor: there is no such track");
  return {means, quaternions, log_scales, logits, residual, lifespan, actor, translation, yaw, pivot, task};
}

void pose_forward(const Pose& pose, Out means, Out quaternions, Out log_scales, Out logits) {
  const size_t n = size_t(pose.task.n);
  expect_size("means", means.size(), 3 * n);
  expect_size("quaternions", quaternions.size(), 4 * n);
  expect_size("log_scales", log_scales.size(), 3 * n);
  expect_size("logits", logits.size(), n);
  const dd::Posed out = {means.data(), quaternions.data(), log_scales.data(), logits.data()};
  nb::gil_scoped_release release;
  dd::pose_forward(pose.task, out);
}

void pose_backward(const Pose& pose, In means, In quaternions, In log_scales, In logits, Out d_means, Out d_quaternions,
                   Out d_logits, Out d_residual, Out d_translation, Out d_yaw) {
  const size_t n = size_t(pose.task.n), actors = size_t(pose.task.actors);
  expect_size("means", means.size(), 3 * n);
  expect_size("quaternions", quaternions.size(), 4 * n);
  expect_size("log_scales", log_scales.size(), 3 * n);
  expect_size("logits", logits.size(), n);
  expect_size("d_means", d_means.size(), 3 * n);
  expect_size("d_quaternions", d_quaternions.size(), 4 * n);
  expect_size("d_logits", d_logits.size(), n);
  expect_size("d_residual", d_residual.size(), 10 * n);
  expect_size("d_translation", d_translation.size(), 3 * actors);
  expect_size("d_yaw", d_yaw.size(), actors);
  const dd::PosedGradient upstream = {means.data(), quaternions.data(), log_scales.data(), logits.data()};
  const dd::PoseGradient out = {d_means.data(),    d_quaternions.data(), d_logits.data(),
                                d_residual.data(), d_translation.data(), d_yaw.data()};
  nb::gil_scoped_release release;
  dd::pose_backward(pose.task, upstream, out);
}

}  // namespace

void bind_motion(nb::module_& m) {
  nb::class_<EncodedNetwork>(m, "EncodedNetwork");
  m.def("encoded_network", &encoded_network, array("tensors"), "depth"_a, "skip"_a, array("means"), array("centre"),
        "radius"_a, "position_octaves"_a, array("time_code"));
  m.def("encoded_network_forward", &encoded_network_forward, "network"_a, array("out"));
  m.def("encoded_network_backward", &encoded_network_backward, "network"_a, array("d_out"), array("gradients"));
  nb::class_<Network>(m, "DenseNetwork");
  m.def("dense_network", &dense_network, array("tensors"), "depth"_a);
  m.def("dense_network_forward", &dense_network_forward, "network"_a, array("inputs"), array("out"));
  m.def("dense_network_backward", &dense_network_backward, "network"_a, array("inputs"), array("d_out"),
        array("d_inputs"), array("gradients"));
  nb::class_<Planes>(m, "Planes");
  m.def("planes", &make_planes, array("space"), array("lines"), array("means"), array("low"), array("high"));
  m.def("planes_forward", &planes_forward, "planes"_a, array("features"));
  m.def("planes_backward", &planes_backward, "planes"_a, array("d_features"), array("d_space"), array("d_lines"));
  m.def("steepness", &steepness, array("images"), "weight"_a, maybe("d_images"));
  nb::class_<Pose>(m, "Pose");
  m.def("pose", &make_pose, array("means"), array("quaternions"), array("log_scales"), array("logits"), array("residual"),
        maybe("lifespan"), maybe("actor"), array("translation"), array("yaw"), array("pivot"), array("up"), "time_s"_a);
  m.def("pose_forward", &pose_forward, "pose"_a, array("means"), array("quaternions"), array("log_scales"),
        array("logits"));
  m.def("pose_backward", &pose_backward, "pose"_a, array("means"), array("quaternions"), array("log_scales"),
        array("logits"), array("d_means"), array("d_quaternions"), array("d_logits"), array("d_residual"),
        array("d_translation"), array("d_yaw"));
}
