#include "pose.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "threads.h"

namespace dd {
namespace {

constexpr int64_t kPoseRows = 1024;  // of one task; fixes the order of summation

struct Turn {
  float cosine, sine, half_cosine, half_sine;
};

struct Vector {
  float x, y, z;
  friend Vector operator+(Vector a, Vector b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
  friend Vector operator-(Vector a, Vector b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
  friend Vector operator*(float s, Vector a) { return {s * a.x, s * a.y, s * a.z}; }
};
Vector vector_at(const float* p) { return {p[0], p[1], p[2]}; }
void put(float* p, Vector v) { p[0] = v.x, p[1] = v.y, p[2] = v.z; }
float dot(Vector a, Vector b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
Vector cross(Vector a, Vector b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }

// Rodrigues' formula.
Vector rotated(Vector v, Vector axis, float cosine, float sine) {
  const Vector along = dot(v, axis) * axis;
  return along + cosine * (v - along) + sine * cross(axis, v);
}

struct Quaternion {
  float w;
  Vector v;
};
Quaternion operator*(Quaternion a, Quaternion b) {
  return {a.w * b.w - dot(a.v, b.v), a.w * b.v + b.w * a.v + cross(a.v, b.v)};
}
float dot(Quaternion a, Quaternion b) { return a.w * b.w + dot(a.v, b.v); }
Quaternion quaternion_at(const float* p) { return {p[0], vector_at(p + 1)}; }
void put(float* p, Quaternion q) { p[0] = q.w, put(p + 1, q.v); }

constexpr float kLeastNorm = 1e-12f;  // torch.nn.functional.normalize
float norm_of(Quaternion q) { return std::max(std::sqrt(dot(q, q)), kLeastNorm); }

// exp(80) still fits float32; an opacity of logit 80 is 1 to the last bit.
constexpr float kMostLogit = 80.0f;

// logit of opacity times exp(-e) is logit - e - log(1 + gone), gone = exp(logit) (1 - exp(-e)).
struct Fade {
  float exponent, gone;
};
Fade fade(const PoseTask& task, int64_t i) {
  const float away = (task.time_s - task.lifespan[2 * i]) / std::max(task.lifespan[2 * i + 1], 1e-6f);
  const float exponent = 0.5f * away * away;
  return {exponent, std::exp(std::min(task.logits[i], kMostLogit)) * -std::expm1(-exponent)};
}

std::vector<Turn> turns(const PoseTask& task) {
  std::vector<Turn> out(task.actors);
  for (int64_t a = 0; a < task.actors; a++)
    out[a] = {std::cos(task.yaw[a]), std::sin(task.yaw[a]), std::cos(0.5f * task.yaw[a]), std::sin(0.5f * task.yaw[a])};
  return out;
}

void pose_row(const PoseTask& task, const std::vector<Turn>& turns, int64_t i, const Posed& out) {
  const float* residual = task.residual + 10 * i;
  Vector mean = vector_at(task.means + 3 * i);
  const Quaternion raw = quaternion_at(task.quaternions + 4 * i);
  const float norm = norm_of(raw);
  Quaternion unit = {raw.w / norm, {raw.v.x / norm, raw.v.y / norm, raw.v.z / norm}};
  const int64_t actor = task.actor ? task.actor[i] : -1;
  if (actor >= 0) {
    const Vector up = vector_at(task.up), pivot = vector_at(task.pivot + 3 * actor);
    const Turn& turn = turns[actor];
    mean = pivot + rotated(mean - pivot, up, turn.cosine, turn.sine) + vector_at(task.translation + 3 * actor);
    unit = Quaternion{turn.half_cosine, turn.half_sine * up} * unit;
  }
  put(out.means + 3 * i, mean + vector_at(residual));
  const Quaternion added = quaternion_at(residual + 3);
  put(out.quaternions + 4 * i, Quaternion{unit.w + added.w, unit.v + added.v});
  put(out.log_scales + 3 * i, vector_at(task.log_scales + 3 * i) + vector_at(residual + 7));
  out.logits[i] = task.logits[i];
  if (task.lifespan) {
    const Fade f = fade(task, i);
    out.logits[i] = std::min(task.logits[i], kMostLogit) - f.exponent - std::log1p(f.gone);
  }
}

// Adds to sums, (actors, 4), the gradient of the actor's translation and yaw.
void pose_row_backward(const PoseTask& task, const std::vector<Turn>& turns, int64_t i, const PosedGradient& upstream,
                       const PoseGradient& out, float* sums) {
  const Vector d_mean = vector_at(upstream.means + 3 * i), d_log_scale = vector_at(upstream.log_scales + 3 * i);
  const Quaternion d_quaternion = quaternion_at(upstream.quaternions + 4 * i);
  const Quaternion raw = quaternion_at(task.quaternions + 4 * i);
  const float norm = norm_of(raw);
  const Quaternion unit = {raw.w / norm, {raw.v.x / norm, raw.v.y / norm, raw.v.z / norm}};
  Vector d_canonical = d_mean;
  Quaternion d_unit = d_quaternion;
  const int64_t actor = task.actor ? task.actor[i] : -1;
  if (actor >= 0) {
    const Vector up = vector_at(task.up), arm = vector_at(task.means + 3 * i) - vector_at(task.pivot + 3 * actor);
    const Turn& turn = turns[actor];
    d_canonical = rotated(d_mean, up, turn.cosine, -turn.sine);
    d_unit = Quaternion{turn.half_cosine, -turn.half_sine * up} * d_quaternion;
    const Vector across = arm - dot(arm, up) * up;
    const Vector by_yaw = turn.cosine * cross(up, arm) - turn.sine * across;
    const Quaternion turned = Quaternion{-0.5f * turn.half_sine, 0.5f * turn.half_cosine * up} * unit;
    float* sum = sums + 4 * actor;
    sum[0] += d_mean.x, sum[1] += d_mean.y, sum[2] += d_mean.z;
    sum[3] += dot(d_mean, by_yaw) + dot(d_quaternion, turned);
  }
  put(out.means + 3 * i, d_canonical);
  const float along = dot(unit, d_unit);
  const Quaternion across = {d_unit.w - along * unit.w, d_unit.v - along * unit.v};
  put(out.quaternions + 4 * i, Quaternion{across.w / norm, (1.0f / norm) * across.v});
  float* residual = out.residual + 10 * i;
  put(residual, d_mean);
  put(residual + 3, d_quaternion);
  put(residual + 7, d_log_scale);
  out.logits[i] = upstream.logits[i];
  if (task.lifespan)
    out.logits[i] = task.logits[i] <= kMostLogit ? upstream.logits[i] / (1.0f + fade(task, i).gone) : 0.0f;
}

}  // namespace

void pose_forward(const PoseTask& task, const Posed& out) {
  const std::vector<Turn> of_actors = turns(task);
  parallel_for((task.n + kPoseRows - 1) / kPoseRows, [&](int64_t part, int) {
    for (int64_t i = part * kPoseRows; i < std::min(task.n, (part + 1) * kPoseRows); i++) pose_row(task, of_actors, i, out);
  });
}

void pose_backward(const PoseTask& task, const PosedGradient& upstream, const PoseGradient& out) {
  const std::vector<Turn> of_actors = turns(task);
  const int64_t parts = (task.n + kPoseRows - 1) / kPoseRows, size = 4 * task.actors;
  std::vector<float> sums(parts * size, 0.0f);
  parallel_for(parts, [&](int64_t part, int) {
    for (int64_t i = part * kPoseRows; i < std::min(task.n, (part + 1) * kPoseRows); i++)
      pose_row_backward(task, of_actors, i, upstream, out, sums.data() + part * size);
  });
  std::vector<double> total(size, 0.0);
  for (int64_t part = 0; part < parts; part++)
    for (int64_t k = 0; k < size; k++) total[k] += sums[part * size + k];
  for (int64_t a = 0; a < task.actors; a++) {
    for (int k = 0; k < 3; k++) out.translation[3 * a + k] = float(total[4 * a + k]);
    out.yaw[a] = float(total[4 * a + 3]);
  }
}

}  // namespace dd
