// Gradient of the projection and of the view-dependent colour, and the pose's share of both.
#include "ewa.h"
#include "kernel_list.h"
#include "sh.h"

namespace dd::DD_ISA {
namespace {

// Gradient by the splat of kLanes Gaussians, gathered from their tiles.
struct SplatGradient {
  alignas(64) float v[kLanes], v_e[kLanes], v_ee[kLanes], v_y[kLanes], v_ey[kLanes], v_yy[kLanes];
  alignas(64) float colour[3][kLanes], depth[kLanes], absolute_u[kLanes], absolute_v[kLanes];
};

struct PoseSums {
  V3 rotation[3], translation, direction;
};

// Calls act(number of the entry) for the entries of a splat that its tiles reached, in the order of the tiles.
template <class Act>
static inline void each_entry(const BackwardTask& task, uint32_t rank, Act&& act) {
  for (uint32_t k = task.slot_begin[rank]; k < task.slot_begin[rank + 1]; k++) {
    const Slot slot = task.slots[k];
    const uint32_t at = task.reached_begin[slot.tile] + slot.place;
    if (at < task.reached_begin[slot.tile + 1]) act(at);
  }
}

void gather_entries(const BackwardTask& task, uint32_t rank, int lane, SplatGradient& g) {
  float sum[12] = {};
  each_entry(task, rank, [&](uint32_t at) {
    const float* from = &task.entry_gradients[at].v;
    for (int j = 0; j < 12; j++) sum[j] += from[j];
  });
  g.v[lane] = sum[0];
  g.v_e[lane] = sum[1];
  g.v_ee[lane] = sum[2];
  g.v_y[lane] = sum[3];
  g.v_ey[lane] = sum[4];
  g.v_yy[lane] = sum[5];
  for (int ch = 0; ch < 3; ch++) g.colour[ch][lane] = task.splats[rank].colour[ch] > 0 ? sum[6 + ch] : 0.0f;
  g.depth[lane] = sum[9];
  g.absolute_u[lane] = sum[10];
  g.absolute_v[lane] = sum[11];
}

// The entries of one splat lie in many tiles: their memory is called for ahead of time, first that of their places.
void prefetch_places(const BackwardTask& task, uint32_t rank) {
  __builtin_prefetch(&task.splats[rank]);
  __builtin_prefetch(&task.slots[task.slot_begin[rank]]);
}
void prefetch_entries(const BackwardTask& task, uint32_t rank) {
  each_entry(task, rank, [&](uint32_t at) { __builtin_prefetch(&task.entry_gradients[at]); });
}

void gather_channels(const BackwardTask& task, int n_channels, uint32_t rank, float* out) {
  for (int c = 0; c < n_channels; c++) out[c] = 0;
  each_entry(task, rank, [&](uint32_t at) {
    for (int c = 0; c < n_channels; c++) out[c] += task.entry_channels[int64_t(at) * n_channels + c];
  });
}

static inline void scatter(float* rows, int stride, const uint32_t* index, int count, int k, V v) {
  if (!rows) return;
  for (int l = 0; l < count; l++) rows[int64_t(index[l]) * stride + k] = v[l];
}
static inline void scatter3(float* rows, const uint32_t* index, int count, V3 v) {
  scatter(rows, 3, index, count, 0, v.x);
  scatter(rows, 3, index, count, 1, v.y);
  scatter(rows, 3, index, count, 2, v.z);
}
static inline void add(V3& sum, V3 v) {
  sum.x += v.x;
  sum.y += v.y;
  sum.z += v.z;
}
static inline void add(V3& sum, V3 v, V factor) { add(sum, scaled(v, factor)); }

// Colour to SH coefficients and to the mean through the view direction; returns the latter.
V3 colour_gradient(const Inputs& in, const View& view, const uint32_t* index, int count, V3 mean,
                   const SplatGradient& g, float* out_sh) {
  const V3 offset = {mean.x - view.eye[0], mean.y - view.eye[1], mean.z - view.eye[2]};
  const V inverse = 1.0f / vmax(vsqrt(dot(offset, offset)), broadcast(1e-12f));
  const V3 d = scaled(offset, inverse);
  V basis[16], weight[16];
  sh_basis(in.sh_degree, d.x, d.y, d.z, basis);
  const int used = (in.sh_degree + 1) * (in.sh_degree + 1), stride = 3 * in.sh_stored;
  const V upstream[3] = {load(g.colour[0]), load(g.colour[1]), load(g.colour[2])};
  for (int k = 0; k < used; k++) {
    weight[k] = V{};
    for (int ch = 0; ch < 3; ch++) {
      scatter(out_sh, stride, index, count, 3 * k + ch, basis[k] * upstream[ch]);
      if (in.sh_degree) weight[k] += upstream[ch] * gather(in.sh, stride, index, 3 * k + ch);
    }
  }
  if (out_sh)
    for (int l = 0; l < count; l++)
      for (int k = 3 * used; k < stride; k++) out_sh[int64_t(index[l]) * stride + k] = 0;
  if (!in.sh_degree) return V3();
  V by_unit[3];
  sh_gradient(in.sh_degree, d.x, d.y, d.z, weight, by_unit);
  const V3 u = {by_unit[0], by_unit[1], by_unit[2]};
  const V radial = dot(d, u);
  return {(u.x - d.x * radial) * inverse, (u.y - d.y * radial) * inverse, (u.z - d.z * radial) * inverse};
}

// Rotation matrix (rows by_axis) to the raw quaternion.
void quaternion_gradient(const Projection& p, const V3 by_axis[3], const uint32_t* index, int count, float* out) {
  const V3 &a = by_axis[0], &b = by_axis[1], &c = by_axis[2];
  const V w = 2.0f * (p.qx * (c.y - b.z) + p.qy * (a.z - c.x) + p.qz * (b.x - a.y));
  const V x = 2.0f * (p.qy * (a.y + b.x) + p.qz * (a.z + c.x) - 2.0f * p.qx * (b.y + c.z) + p.qw * (c.y - b.z));
  const V y = 2.0f * (p.qx * (a.y + b.x) + p.qz * (b.z + c.y) - 2.0f * p.qy * (a.x + c.z) + p.qw * (a.z - c.x));
  const V z = 2.0f * (p.qx * (a.z + c.x) + p.qy * (b.z + c.y) - 2.0f * p.qz * (a.x + b.y) + p.qw * (b.x - a.y));
  const V radial = p.qw * w + p.qx * x + p.qy * y + p.qz * z;
  scatter(out, 4, index, count, 0, (w - p.qw * radial) * p.inverse_norm);
  scatter(out, 4, index, count, 1, (x - p.qx * radial) * p.inverse_norm);
  scatter(out, 4, index, count, 2, (y - p.qy * radial) * p.inverse_norm);
  scatter(out, 4, index, count, 3, (z - p.qz * radial) * p.inverse_norm);
}

struct FootprintGradient {
  V3 by_t0, by_t1;  // by the rows of (Jacobian x camera rotation)
  V by_u, by_v;
};

// Adds the gradient through the factor of the opacity, sqrt(det / (det + added)) with det = |m0 x m1|^2 and
// added = blur (|m0|^2 + |m1|^2 + blur). v is the gradient by its logarithm.
void dilution_gradient(const Projection& p, V v, V3& by_m0, V3& by_m1) {
  const V det = vmax(dot(p.cross, p.cross), broadcast(1e-30f));
  const V added = kBlur * (dot(p.m0, p.m0) + dot(p.m1, p.m1) + kBlur);
  const V by_det = v * p.inverse_det * added / det, by_added = -kBlur * v * p.inverse_det;
  add(by_m0, cross(p.m1, p.cross), by_det);
  add(by_m1, cross(p.cross, p.m0), by_det);
  add(by_m0, p.m0, by_added);
  add(by_m1, p.m1, by_added);
}

// Splat to the projected covariance, its factor M, and from there to scale and rotation.
FootprintGradient footprint_gradient(const View& view, const Projection& p, V3 scale, const SplatGradient& g, const uint32_t* index,
                                     int count, const Gradients& out) {
  // With (e, f) = inverse covariance times (dx, dy): by the centre v (e, f), by the covariance v (e, f)(e, f)^T / 2.
  // The tiles summed powers of e and dy; f = (dy - cov_xy e) / cov_yy.
  const V inverse = 1.0f / p.cov_yy, share = p.cov_xy * inverse;
  const V v_ee = load(g.v_ee), v_ey = load(g.v_ey) * inverse, v_yy = load(g.v_yy) * inverse * inverse;
  const V k00 = v_ee, k01 = v_ey - share * v_ee, k11 = v_yy - share * (2.0f * v_ey - share * v_ee);
  V3 by_m0 = {k00 * p.m0.x + k01 * p.m1.x, k00 * p.m0.y + k01 * p.m1.y, k00 * p.m0.z + k01 * p.m1.z};
  V3 by_m1 = {k01 * p.m0.x + k11 * p.m1.x, k01 * p.m0.y + k11 * p.m1.y, k01 * p.m0.z + k11 * p.m1.z};
  if (view.antialiased) dilution_gradient(p, load(g.v), by_m0, by_m1);
  const V3 n0 = {by_m0.x * scale.x, by_m0.y * scale.y, by_m0.z * scale.z};
  const V3 n1 = {by_m1.x * scale.x, by_m1.y * scale.y, by_m1.z * scale.z};
  FootprintGradient f;
  f.by_t0 = {dot(p.axis[0], n0), dot(p.axis[1], n0), dot(p.axis[2], n0)};
  f.by_t1 = {dot(p.axis[0], n1), dot(p.axis[1], n1), dot(p.axis[2], n1)};
  f.by_u = load(g.v_e);
  f.by_v = load(g.v_y) * inverse - share * f.by_u;
  const V t0[3] = {p.t0.x, p.t0.y, p.t0.z}, t1[3] = {p.t1.x, p.t1.y, p.t1.z};
  V3 by_axis[3], by_scale;
  for (int k = 0; k < 3; k++) {
    by_axis[k] = {t0[k] * n0.x + t1[k] * n1.x, t0[k] * n0.y + t1[k] * n1.y, t0[k] * n0.z + t1[k] * n1.z};
    by_scale.x += p.axis[k].x * (t0[k] * by_m0.x + t1[k] * by_m1.x);
    by_scale.y += p.axis[k].y * (t0[k] * by_m0.y + t1[k] * by_m1.y);
    by_scale.z += p.axis[k].z * (t0[k] * by_m0.z + t1[k] * by_m1.z);
  }
  scatter3(out.scales, index, count, by_scale);
  quaternion_gradient(p, by_axis, index, count, out.quaternions);
  return f;
}

// Centre, depth and Jacobian to the centre in the camera frame; adds the covariance's share of the camera rotation.
V3 camera_gradient(const View& view, const Projection& p, const FootprintGradient& f, V by_depth, PoseSums& pose) {
  const float* r = view.rotation;
  const V3 r0 = {broadcast(r[0]), broadcast(r[1]), broadcast(r[2])};
  const V3 r1 = {broadcast(r[3]), broadcast(r[4]), broadcast(r[5])};
  const V3 r2 = {broadcast(r[6]), broadcast(r[7]), broadcast(r[8])};
  const V sx = view.fx * p.inverse_z, sy = view.fy * p.inverse_z;
  add(pose.rotation[0], f.by_t0, sx);
  add(pose.rotation[1], f.by_t1, sy);
  add(pose.rotation[2], f.by_t0, -sx * p.tx);
  add(pose.rotation[2], f.by_t1, -sy * p.ty);
  const V by_j02 = dot(f.by_t0, r2), by_j12 = dot(f.by_t1, r2);
  const V x = p.camera.x * p.inverse_z, y = p.camera.y * p.inverse_z;
  // J = [fx/z, 0, -fx tx/z; 0, fy/z, -fy ty/z]; the clamp stops the gradient of tx, ty.
  const V by_tx = masked((x >= view.min_tx) & (x <= view.max_tx), -sx * by_j02);
  const V by_ty = masked((y >= view.min_ty) & (y <= view.max_ty), -sy * by_j12);
  const V by_x = by_tx + view.fx * f.by_u, by_y = by_ty + view.fy * f.by_v;
  const V by_inverse_z = view.fx * (dot(f.by_t0, r0) - p.tx * by_j02) + view.fy * (dot(f.by_t1, r1) - p.ty * by_j12) +
                         by_x * p.camera.x + by_y * p.camera.y;
  return {by_x * p.inverse_z, by_y * p.inverse_z, by_depth - p.inverse_z * p.inverse_z * by_inverse_z};
}

void lanes_gradient(const Inputs& in, const View& view, const BackwardTask& task, const uint32_t* index, int count,
                    PoseSums& pose) {
  SplatGradient g;
  __builtin_memset(&g, 0, sizeof(g));
  for (int l = 0; l < count; l++) {
    gather_entries(task, task.rank[index[l]], l, g);
    if (task.out.channels)
      gather_channels(task, in.n_channels, task.rank[index[l]], task.out.channels + int64_t(index[l]) * in.n_channels);
  }
  Projection p;
  const V3 mean = gather3(in.means, 3, index), scale = gather3(in.scales, 3, index);
  unit_quaternion(gather(in.quaternions, 4, index, 0), gather(in.quaternions, 4, index, 1),
                  gather(in.quaternions, 4, index, 2), gather(in.quaternions, 4, index, 3), p);
  project_lanes(view, mean, scale, p);
  const FootprintGradient f = footprint_gradient(view, p, scale, g, index, count, task.out);
  const V3 by_camera = camera_gradient(view, p, f, load(g.depth), pose);
  const V3 by_direction = colour_gradient(in, view, index, count, mean, g, task.out.sh);
  const float* r = view.rotation;
  scatter3(task.out.means, index, count,
           {r[0] * by_camera.x + r[3] * by_camera.y + r[6] * by_camera.z + by_direction.x,
            r[1] * by_camera.x + r[4] * by_camera.y + r[7] * by_camera.z + by_direction.y,
            r[2] * by_camera.x + r[5] * by_camera.y + r[8] * by_camera.z + by_direction.z});
  scatter(task.out.opacities, 1, index, count, 0, load(g.v) / gather(in.opacities, 1, index, 0));
  scatter(task.out.screen, 2, index, count, 0, f.by_u);
  scatter(task.out.screen, 2, index, count, 1, f.by_v);
  scatter(task.out.screen_absolute, 2, index, count, 0, load(g.absolute_u));
  scatter(task.out.screen_absolute, 2, index, count, 1, load(g.absolute_v));
  // Lanes beyond count repeat a Gaussian with zero upstream gradient, so they add nothing here.
  add(pose.rotation[0], mean, by_camera.x);
  add(pose.rotation[1], mean, by_camera.y);
  add(pose.rotation[2], mean, by_camera.z);
  add(pose.translation, by_camera);
  add(pose.direction, by_direction);
}

void clear(float* rows, int stride, int64_t i) {
  if (rows) __builtin_memset(rows + i * stride, 0, sizeof(float) * stride);
}
void clear_all(const Inputs& in, const Gradients& out, int64_t i) {
  clear(out.means, 3, i);
  clear(out.quaternions, 4, i);
  clear(out.scales, 3, i);
  clear(out.opacities, 1, i);
  clear(out.sh, 3 * in.sh_stored, i);
  clear(out.channels, in.n_channels, i);
  clear(out.screen, 2, i);
  clear(out.screen_absolute, 2, i);
}

// The camera centre is -R^T t: its share of the gradient goes to all of R and t.
void pose_rows(const View& view, const PoseSums& sums, float* pose) {
  const float eye[3] = {-sum_lanes(sums.direction.x), -sum_lanes(sums.direction.y), -sum_lanes(sums.direction.z)};
  const float translation[3] = {sum_lanes(sums.translation.x), sum_lanes(sums.translation.y),
                                sum_lanes(sums.translation.z)};
  for (int row = 0; row < 3; row++) {
    const V3& by_rotation = sums.rotation[row];
    const float* r = view.rotation + 3 * row;
    pose[4 * row] = sum_lanes(by_rotation.x) - view.translation[row] * eye[0];
    pose[4 * row + 1] = sum_lanes(by_rotation.y) - view.translation[row] * eye[1];
    pose[4 * row + 2] = sum_lanes(by_rotation.z) - view.translation[row] * eye[2];
    pose[4 * row + 3] = translation[row] - (r[0] * eye[0] + r[1] * eye[1] + r[2] * eye[2]);
  }
}

}  // namespace

void project_backward(const Inputs& in, const View& view, const BackwardTask& task, int64_t first, int64_t last,
                      float* pose) {
  constexpr int kAhead = 16;
  uint32_t list[kChunk + kLanes];
  int n = 0;
  for (int64_t i = first; i < last; i++) {
    const uint32_t rank = task.rank[i];
    if (rank != kHidden)
      list[n++] = uint32_t(i);
    else
      clear_all(in, task.out, i);
  }
  for (int l = 0; l < kLanes && n; l++) list[n + l] = list[n - 1];
  PoseSums sums;
  for (int i = 0; i < n; i += kLanes) {
    const int next = i ? i + kAhead : 0, end = i + kAhead + kLanes;
    for (int k = next + kAhead; k < end + kAhead && k < n; k++) prefetch_places(task, task.rank[list[k]]);
    for (int k = next; k < end && k < n; k++) prefetch_entries(task, task.rank[list[k]]);
    lanes_gradient(in, view, task, list + i, n - i < kLanes ? n - i : kLanes, sums);
  }
  pose_rows(view, sums, pose);
}

}  // namespace dd::DD_ISA
